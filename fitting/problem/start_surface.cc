// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/problem/start_surface.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <numeric>

#include "surfaces/base/error.h"

namespace semblance::fitting {
namespace {

Vec3 Around(double turns) {
  const double angle = 2 * std::numbers::pi * turns;
  return {1, std::cos(angle), std::sin(angle)};
}

// The functions of (u,v) whose linear combinations give the surface.
Vec3 OpenFunctions(const Vec2& uv) { return {1, uv.x(), uv.y()}; }

Eigen::Matrix<double, 6, 1> TubeFunctions(const Vec2& uv) {
  const Vec3 u = Around(uv.x());
  return (Eigen::Matrix<double, 6, 1>() << u, uv.y() * u).finished();
}

template <int n>
ControlNet FitNet(Eigen::Matrix<double, n, 1> (*functions)(const Vec2&), const HSplineShape& shape,
                  std::span<const Vec3> positions, std::span<const Vec2> uv) {
  Eigen::Matrix<double, n, n> normal = Eigen::Matrix<double, n, n>::Zero();
  Eigen::Matrix<double, n, 3> right = Eigen::Matrix<double, n, 3>::Zero();
  const Vec3 mean = std::accumulate(positions.begin(), positions.end(), Vec3(Vec3::Zero())) /
                    static_cast<double>(positions.size());
  for (std::size_t k = 0; k < positions.size(); ++k) {
    const Eigen::Matrix<double, n, 1> f = functions(uv[k]);
    normal += f * f.transpose();
    right += f * (positions[k] - mean).transpose();
  }
  const Eigen::MatrixXd x =
      Eigen::MatrixXd(normal).completeOrthogonalDecomposition().solve(Eigen::MatrixXd(right));
  ControlNet net{shape.Columns(0), shape.Rows(0), {}};
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      const Vec2 place((i - 1.0) / shape.patches_u, (j - 1.0) / shape.patches_v);
      net.vertices.push_back(mean + x.transpose() * functions(place));
    }
  }
  return net;
}

void Check(const HSplineShape& shape, std::span<const Vec3> positions, std::span<const Vec2> uv) {
  CheckShape(shape);
  if (positions.empty() || uv.size() != positions.size()) {
    throw InputError(
        fmt::format("start surface: {} points with {} pairs (u,v); give at least one point, and "
                    "(u,v) for each",
                    positions.size(), uv.size()));
  }
}

}  // namespace

HSplineSurface StartSurface(const HSplineShape& shape, std::span<const Vec3> positions,
                            std::span<const Vec2> uv) {
  Check(shape, positions, uv);
  return HSplineSurface(shape, shape.ClosedU() ? FitNet(TubeFunctions, shape, positions, uv)
                                               : FitNet(OpenFunctions, shape, positions, uv));
}

}  // namespace semblance::fitting
