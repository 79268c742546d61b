// SPDX-License-Identifier: GPL-3.0-or-later
// Hollows and ridges of a surface at some scale.
#pragma once

#include <Eigen/Core>
#include <span>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// How far each vertex lies below (above 0, in a hollow) or above (below 0, on a ridge) the surface
// smoothed over a scale, along its normal, mm: one row per scale. Let x be the points, n the
// normals: ((1 - scale^2 Laplace)^-1 x - x) . n, one implicit step of the mean curvature flow
// (Desbrun et al. 1999, eq. 5); for scales below the radii of curvature about -scale^2 times twice
// the mean curvature. scales_mm: > 0.
Eigen::MatrixXd BoneRelief(const TriMesh& mesh, std::span<const double> scales_mm);

}  // namespace semblance
