// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/curvature.h"

#include <Eigen/Eigenvalues>

namespace semblance {

std::optional<SurfaceCurvature> CurvatureAt(const HSplineSurface& surface, const Vec2& uv) {
  const SurfaceFrame frame = surface.Frame(uv);
  if (!frame.regular) {
    return std::nullopt;
  }
  const SecondDerivatives second = surface.Second(uv);
  const Vec3 normal = frame.Normal();
  Eigen::Matrix2d bend;  // the second fundamental form
  bend << normal.dot(second.duu), normal.dot(second.duv), normal.dot(second.duv),
      normal.dot(second.dvv);
  // Tangents along the frame's first two axes, as steps in (u,v): du = a t, dv = b t + c s.
  const double a = frame.axes.col(0).dot(frame.du), b = frame.axes.col(0).dot(frame.dv),
               c = frame.axes.col(1).dot(frame.dv);
  Eigen::Matrix2d steps;
  steps << 1 / a, -b / (a * c), 0, 1 / c;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(steps.transpose() * bend * steps);
  SurfaceCurvature curvature;
  curvature.smallest_per_mm = solver.eigenvalues()[0];
  curvature.largest_per_mm = solver.eigenvalues()[1];
  curvature.largest_direction = frame.axes.leftCols<2>() * solver.eigenvectors().col(1);
  curvature.smallest_direction = normal.cross(curvature.largest_direction);
  return curvature;
}

}  // namespace semblance
