// SPDX-License-Identifier: GPL-3.0-or-later
// The cotangent Laplacian of a skull as it comes: open, of several pieces, with slivers.
#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct MeshLaplacian {
  // u' stiffness u is the integral of the squared gradient; symmetric, rows sum to 0, entries off
  // the diagonal negative. Both triangles.
  Eigen::SparseMatrix<double> stiffness;
  Eigen::VectorXd area_mm2;  // a third of the triangles around each vertex, > 0
};

// Cotangents of each triangle are held within +-100, and an edge's sum is at least 1e-4, so that
// slivers and obtuse pairs cannot spoil the equations; no harmonic function leaves the range of its
// data then. Areas are at least 1e-2 of their mean. A vertex without a triangle has a row of 0.
// Triangles may share edges in any number and way.
MeshLaplacian BuildLaplacian(const TriMesh& mesh);

// The piece of each vertex by the matrix's entries, numbered 0, 1, ... in order of the first
// vertex.
std::vector<int> LabelComponents(const Eigen::SparseMatrix<double>& stiffness);

}  // namespace semblance
