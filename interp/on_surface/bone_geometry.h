// SPDX-License-Identifier: GPL-3.0-or-later
// Where a place of the bone lies in the head.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "interp/dowels/dowel.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// As the dowels tell it, whatever the axes of the scan.
struct HeadFrame {
  Vec3 left = Vec3::Constant(kNaN), front = left, up = left;  // unit, orthogonal
  std::vector<Vec3> orbits;                                   // their centres, one or two, mm
};

// Left by the pairs of dowels, without one across the plane of those in the midline; front by the
// mean of the dowels' directions. An orbit's centre is midway between mso and mio of its side, else
// at the one of them that is there; without any, one stands at the mean of the bases. Throws
// InputError where neither a pair nor three in the midline and one beside it are there.
HeadFrame FrameOfHead(std::span<const Dowel> dowels);

// 4 x vertices: mm below the convex hull of the mesh (what a wrap bridges); the part of the unit
// normal that is to the front, and that is up; mm to the nearer orbit's centre.
inline constexpr Eigen::Index kBoneGeometry = 4;
Eigen::MatrixXd BoneGeometry(const TriMesh& mesh, const HeadFrame& frame);

}  // namespace semblance
