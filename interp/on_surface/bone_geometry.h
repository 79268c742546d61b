// SPDX-License-Identifier: GPL-3.0-or-later
// The shape of the bone: position in the head, and hollows and ridges.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "interp/dowels/dowel.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::interp {

// The axes of the head, computed from the dowels and independent of the scan's axes.
struct HeadFrame {
  Vec3 left = Vec3::Constant(kNaN), front = left, up = left;  // unit, orthogonal
  std::vector<Vec3> orbits;  // centers of the orbits, one or two, mm
};

// Computes the axes. Left is the mean direction from right to left dowels of pairs or, without
// pairs, the normal of the plane of the midline dowels. Front is the mean of the dowels'
// directions. An orbit's center is midway between mso and mio of its side, or at the one that
// exists; without any, the mean of the bases counts as the only orbit. Throws InputError if there
// is neither a pair of dowels nor three midline dowels and one beside them.
HeadFrame FindHeadFrame(std::span<const Dowel> dowels);

// The bone's geometry, 4 x vertices: distance below the convex hull of the mesh (the gap that a
// wrap would bridge), mm; front and up components of the unit normal; distance to the nearer
// orbit's center, mm.
inline constexpr Eigen::Index kBoneGeometry = 4;
Eigen::MatrixXd BoneGeometry(const TriMesh& mesh, const HeadFrame& frame);

// The relief of the bone, in mm, with one row per scale (> 0) and one column per vertex: the
// distance along the normal from the vertex to the surface smoothed over the scale. It is positive
// in a hollow and negative on a ridge. With points x and normals n it is ((1 - scale^2 Laplace)^-1
// x - x) . n, one implicit step of mean curvature flow (Desbrun et al. 1999, eq. 5). For scales
// below the radii of curvature it is about -scale^2 times twice the mean curvature.
Eigen::MatrixXd BoneRelief(const TriMesh& mesh, std::span<const double> scales_mm);

}  // namespace semblance::interp
