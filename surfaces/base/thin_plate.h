// SPDX-License-Identifier: GPL-3.0-or-later
// The thin-plate spline (Bookstein 1989): a smooth map of space that moves given points to given
// points.
#pragma once

#include <span>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::surfaces {

struct ThinPlateOptions {
  // Weight of the bending energy relative to the squared misfit of the points, in mm, >= 0. With 0
  // the map meets all points. With many points x mm apart, a stiffness of about x suppresses part
  // of their noise. As the stiffness grows, the map tends to the affine least-squares map.
  double stiffness_mm = 0;
};

// The map p -> affine * (p, 1) - sum_i weights_i |p - centers_i|. Among all maps with the same
// misfit at the centers it bends least: it minimises the integral of its squared second derivatives
// over space. Far from the centers it tends to its affine part.
struct ThinPlate {
  std::vector<Vec3> centers;            // n, mm
  std::vector<Vec3> weights;            // n; orthogonal to all affine functions
  Eigen::Matrix<double, 3, 4> affine =  // columns: x, y, z, 1
      Eigen::Matrix<double, 3, 4>::Constant(kNaN);

  Vec3 operator()(const Vec3& p) const;
};

// Computes the map f that minimises sum_i w_i |f(from_i) - to_i|^2 + stiffness_mm * (integral over
// space of |second derivatives of f|^2). The kernel is Green's function of the biharmonic operator
// in three dimensions, -|p| / (8 pi) (Wahba 1990). Bookstein's kernel r^2 log r is the one for the
// plane.
//   from, to: n points each, mm; weights: n values > 0, or none: all 1.
// Throws InputError if the sizes differ, a value is not finite or out of range, the points `from`
// lie in a plane (as fewer than four always do), or two of them coincide while the stiffness is 0.
ThinPlate FitThinPlate(std::span<const Vec3> from, std::span<const Vec3> to,
                       std::span<const double> weights = {}, const ThinPlateOptions& options = {});

}  // namespace semblance::surfaces
