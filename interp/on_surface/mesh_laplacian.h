// SPDX-License-Identifier: GPL-3.0-or-later
// The cotangent Laplacian for a skull mesh of any quality: open, in several pieces, with slivers.
#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::interp {

struct MeshLaplacian {
  // u' stiffness u is the integral of the squared gradient of u. Symmetric (both triangles are
  // stored), with row sums of 0 and negative entries off the diagonal.
  Eigen::SparseMatrix<double> stiffness;
  Eigen::VectorXd area_mm2;  // a third of the area of the triangles around each vertex, > 0
};

// Builds the Laplacian. Cotangents are limited to +-100, and the sum of an edge's two half
// cotangents is at least 1e-4. Hence slivers and obtuse pairs of triangles cannot spoil the
// equations, and no harmonic function leaves the range of its data. Areas are at least 1e-2 of
// their mean. A vertex without a triangle has a row of 0. Edges may belong to any number of
// triangles.
MeshLaplacian BuildLaplacian(const TriMesh& mesh);

// The connected component of each vertex in the matrix's graph, numbered 0, 1, ... in order of the
// first vertex.
std::vector<int> LabelPieces(const Eigen::SparseMatrix<double>& stiffness);

}  // namespace semblance::interp
