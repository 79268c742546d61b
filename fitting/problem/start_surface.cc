// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/problem/start_surface.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <numeric>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

// The functions of (u,v) whose sums the surface is taken from.
Eigen::VectorXd Functions(const HSplineShape& shape, const Vec2& uv) {
  if (shape.closure == Closure::kOpen) {
    return Vec3(1, uv.x(), uv.y());
  }
  const double angle = 2 * std::numbers::pi * uv.x(), c = std::cos(angle), s = std::sin(angle);
  Eigen::VectorXd f(6);
  f << 1, c, s, uv.y(), uv.y() * c, uv.y() * s;
  return f;
}

}  // namespace

HSplineSurface StartSurface(const HSplineShape& shape, std::span<const Vec3> positions,
                            std::span<const Vec2> uv) {
  CheckShape(shape);
  if (positions.empty() || uv.size() != positions.size()) {
    throw InputError(
        fmt::format("start surface: {} points with {} pairs (u,v); give at least one point, and "
                    "(u,v) for each",
                    positions.size(), uv.size()));
  }
  const Eigen::Index n = Functions(shape, Vec2::Zero()).size();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n), right = Eigen::MatrixXd::Zero(n, 3);
  const Vec3 mean = std::accumulate(positions.begin(), positions.end(), Vec3(Vec3::Zero())) /
                    static_cast<double>(positions.size());
  for (std::size_t k = 0; k < positions.size(); ++k) {
    const Eigen::VectorXd f = Functions(shape, uv[k]);
    normal += f * f.transpose();
    right += f * (positions[k] - mean).transpose();
  }
  const Eigen::MatrixXd x = normal.completeOrthogonalDecomposition().solve(right);
  ControlNet net{shape.Columns(0), shape.Rows(0), {}};
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      const Vec2 place((i - 1.0) / shape.patches_u, (j - 1.0) / shape.patches_v);
      net.vertices.push_back(mean + x.transpose() * Functions(shape, place));
    }
  }
  return HSplineSurface(shape, net);
}

}  // namespace semblance
