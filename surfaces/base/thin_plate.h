// SPDX-License-Identifier: GPL-3.0-or-later
// A smooth map of space that carries points to points: the thin-plate spline (Bookstein 1989).
#pragma once

#include <span>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

struct ThinPlateOptions {
  // mm; >= 0. Weight of the bending energy against the squared misfit of the points. 0 meets all
  // points; with many points x mm apart, a stiffness of about x keeps some of their noise out.
  // Without bound the map becomes the affine map of least squares.
  double stiffness_mm = 0;
};

// p -> affine * (p, 1) - sum_i weights_i |p - centers_i|. Bends least, among all maps that leave
// the same misfit at its centers: the integral of its squared second derivatives over space is
// minimal. Far from the centers it tends to its affine part.
struct ThinPlate {
  std::vector<Vec3> centers;            // n, mm
  std::vector<Vec3> weights;            // n; orthogonal to all affine functions
  Eigen::Matrix<double, 3, 4> affine =  // of x, y, z, 1
      Eigen::Matrix<double, 3, 4>::Constant(kNaN);

  Vec3 operator()(const Vec3& p) const;
};

// The map f that minimises sum_i w_i |f(from_i) - to_i|^2 + stiffness_mm * (integral over space of
// |second derivatives of f|^2). The kernel is Green's function of the biharmonic operator in three
// dimensions, -|p| / (8 pi) (Wahba 1990; Bookstein's r^2 log r is that of the plane).
//   from, to: n points each, mm; weights: n values > 0, or none: all 1.
// Throws InputError if the numbers disagree, a value is not finite or not in its range, the points
// `from` lie in a plane (fewer than four always do), or, without stiffness, two of them coincide.
ThinPlate FitThinPlate(std::span<const Vec3> from, std::span<const Vec3> to,
                       std::span<const double> weights = {}, const ThinPlateOptions& options = {});

}  // namespace semblance
