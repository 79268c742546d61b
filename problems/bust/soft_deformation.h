// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh that follows some of its points, and bends little between them.
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct SoftTarget {
  std::int32_t vertex = -1;
  Vec3 position = Vec3::Constant(kNaN);  // mm
  double weight = 1;                     // > 0; 1: as DeformOptions::detail_mm says
};

struct DeformOptions {
  // Where all vertices have targets of weight 1, waves of the targets longer than 2 pi times this
  // are followed, shorter ones are smoothed.
  double detail_mm = 2;
  // Away from targets the displacement bends over shorter distances than this, and levels out over
  // longer ones.
  double calm_mm = 35;
  // Farther than about fade^2 / calm from all targets it is gone.
  double fade_mm = 50;
};

// Keeps the equations of a mesh for several sets of targets.
class SoftDeformation {
 public:
  SoftDeformation(const TriMesh& mesh, const DeformOptions& options);

  // The points of the mesh plus the displacement d that minimises, with l = detail_mm,
  //   integral of w |d - d_target|^2
  //     + l^4 (|laplacian d|^2 + |gradient d|^2 / calm^2 + |d|^2 / fade^4)
  // in the cotangent discretisation (Botsch and Sorkine 2008, the linear bi-Laplacian); one sparse
  // Cholesky factorisation. A vertex may have several targets. Without a target nothing moves.
  std::vector<Vec3> Follow(std::span<const SoftTarget> targets) const;

 private:
  std::vector<Vec3> points_;
  Eigen::VectorXd area_mm2_;             // of each vertex
  Eigen::SparseMatrix<double> bending_;  // all but the targets
};

// Triangles that were turned over: whose normal, from `before` to `after`, turned by more than 90
// degrees beyond the rotation that the whole made. Both meshes have the same triangles.
std::vector<std::int32_t> TurnedOver(const TriMesh& before, const TriMesh& after,
                                     const Mat3& rotation);

}  // namespace semblance
