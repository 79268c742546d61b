// SPDX-License-Identifier: GPL-3.0-or-later
// Deforms a mesh so that some of its points meet targets and the rest bends little.
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

struct SoftTarget {
  std::int32_t vertex = -1;
  Vec3 position = Vec3::Constant(kNaN);  // mm
  double weight = 1;                     // > 0; DeformOptions::detail_mm holds for 1
};

struct DeformOptions {
  // With targets of weight 1 at all vertices, waves of the targets longer than 2 pi detail_mm are
  // followed; shorter ones are smoothed.
  double detail_mm = 2;
  // Away from targets the displacement continues in a smooth bend over this distance, and levels
  // out beyond it.
  double level_out_mm = 35;
  // The displacement vanishes at about fade_mm^2 / level_out_mm from all targets.
  double fade_mm = 50;
};

// Keeps the equations of a mesh for several sets of targets.
class SoftDeformation {
 public:
  SoftDeformation(const TriMesh& mesh, const DeformOptions& options);

  // The points of the mesh plus the displacement d that minimises, with l = detail_mm,
  //   integral of w |d - d_target|^2
  //     + l^4 (|laplacian d|^2 + |gradient d|^2 / level_out^2 + |d|^2 / fade^4)
  // in the cotangent discretisation (Botsch and Sorkine 2008, the linear bi-Laplacian); one sparse
  // Cholesky factorisation. A vertex may have several targets. Without a target nothing moves.
  std::vector<Vec3> Follow(std::span<const SoftTarget> targets) const;

 private:
  std::vector<Vec3> points_;
  Eigen::VectorXd area_mm2_;             // of each vertex
  Eigen::SparseMatrix<double> bending_;  // everything except the targets
};

// The triangles whose normal turned by more than 90 degrees from `before` to `after`, apart from
// the rotation of the whole mesh. Both meshes have the same triangles.
std::vector<std::int32_t> TurnedOver(const TriMesh& before, const TriMesh& after,
                                     const Mat3& rotation);

}  // namespace semblance::problems
