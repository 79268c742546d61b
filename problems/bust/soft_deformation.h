// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh that follows some of its points, and bends little between them.
#pragma once

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
  double calm_mm = 60;
  // Over longer distances than this it fades.
  double fade_mm = 250;
};

// The points of `mesh` plus the displacement d that minimises, with l = detail_mm,
//   integral of w |d - d_target|^2 + l^4 (|laplacian d|^2 + |gradient d|^2 / calm^2 + |d|^2 /
//   fade^4)
// in the cotangent discretisation (Botsch and Sorkine 2008, the linear bi-Laplacian). One sparse
// Cholesky factorisation. A vertex may have several targets. Without a target nothing moves.
std::vector<Vec3> Deform(const TriMesh& mesh, std::span<const SoftTarget> targets,
                         const DeformOptions& options);

// Triangles that were turned over: whose normal, from `before` to `after`, turned by more than 90
// degrees beyond the rotation that the whole made. Both meshes have the same triangles.
std::vector<std::int32_t> TurnedOver(const TriMesh& before, const TriMesh& after,
                                     const Mat3& rotation);

}  // namespace semblance
