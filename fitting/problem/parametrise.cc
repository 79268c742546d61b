// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/problem/parametrise.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

[[noreturn]] void Fail(const std::string& what) { throw InputError("parameters: " + what); }

struct Scattered {
  std::span<const Vec3> positions;
  std::span<const Vec2> given_uv;
};

Vec3 MeanOf(std::span<const Vec3> points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : points) {
    sum += p;
  }
  return sum / static_cast<double>(points.size());
}

// Columns: principal directions, the shortest first; each with its largest entry positive, so that
// no sign is left to chance.
struct Principal {
  Vec3 mean;
  Mat3 axes;
  Vec3 spreads;  // mean squares along them, ascending
};

Principal PrincipalOf(std::span<const Vec3> points) {
  Principal p{.mean = MeanOf(points), .axes = {}, .spreads = {}};
  Mat3 moments = Mat3::Zero();
  for (const Vec3& x : points) {
    moments += (x - p.mean) * (x - p.mean).transpose() / static_cast<double>(points.size());
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(moments);
  p.axes = eigen.eigenvectors();
  p.spreads = eigen.eigenvalues();
  for (int k = 0; k < 3; ++k) {
    Eigen::Index at = 0;
    p.axes.col(k).cwiseAbs().maxCoeff(&at);
    p.axes.col(k) *= p.axes(at, k) < 0 ? -1 : 1;
  }
  return p;
}

// To 0..1.
void Normalise(int coordinate, const std::string& what, std::vector<Vec2>& uv) {
  double low = uv.front()[coordinate], high = low;
  for (const Vec2& p : uv) {
    low = std::min(low, p[coordinate]);
    high = std::max(high, p[coordinate]);
  }
  if (!(high > low)) {
    Fail(fmt::format("the points have no extent along {}; give (u,v), or other points", what));
  }
  for (Vec2& p : uv) {
    p[coordinate] = std::clamp((p[coordinate] - low) / (high - low), 0.0, 1.0);
  }
}

Parametrisation ParametersOf(const Scattered& points, const GivenParameters& given) {
  if (points.given_uv.empty()) {
    Fail(
        "type 'given' needs each point's (u,v) (of a table, the columns u and v); give them, or "
        "take 'plane' or 'cylinder'");
  }
  const std::array<std::array<double, 2>, 2> ranges = {given.u_range, given.v_range};
  for (const auto& [low, high] : ranges) {
    if (!(high > low)) {
      Fail(fmt::format("the range [{}, {}] is empty; give the lower bound first", low, high));
    }
  }
  Parametrisation result{.uv = {}, .source = ParameterSource::kGiven};
  for (std::size_t k = 0; k < points.given_uv.size(); ++k) {
    Vec2 uv;
    for (const int c : {0, 1}) {
      uv[c] = (points.given_uv[k][c] - ranges[c][0]) / (ranges[c][1] - ranges[c][0]);
    }
    if (!(uv.minCoeff() >= 0 && uv.maxCoeff() <= 1)) {
      Fail(
          fmt::format("point {} has (u,v) = ({}, {}) outside [{}, {}] x [{}, {}]; widen u_range "
                      "and v_range",
                      k, points.given_uv[k].x(), points.given_uv[k].y(), ranges[0][0], ranges[0][1],
                      ranges[1][0], ranges[1][1]));
    }
    result.uv.push_back(uv);
  }
  return result;
}

// Directions of u and v, unit.
using PlaneAxes = std::array<Vec3, 2>;

PlaneAxes LeastSquaresPlane(std::span<const Vec3> positions) {
  constexpr double kRounding = 1e-14;  // of mean squares; points of a slanted line come to 1e-16
  const Principal principal = PrincipalOf(positions);
  if (!(principal.spreads[1] > kRounding * principal.spreads[2])) {
    Fail("the points lie on a line and span no plane; give (u,v), or other points");
  }
  return {principal.axes.col(2), principal.axes.col(1)};
}

PlaneAxes PlaneAcross(const Vec3& normal) {
  if (!normal.allFinite()) {
    Fail("the plane's normal is not finite; give three numbers");
  }
  const Vec3 unit = normal.normalized();
  Eigen::Index flattest = 0;
  unit.cwiseAbs().minCoeff(&flattest);
  const Vec3 axis = Vec3::Unit(flattest), u = (axis - axis.dot(unit) * unit).normalized();
  return {u, unit.cross(u)};
}

Parametrisation ParametersOf(const Scattered& points, const PlaneParameters& plane) {
  const Vec3 normal(plane.normal[0], plane.normal[1], plane.normal[2]);
  const auto [u, v] = normal.isZero(0) ? LeastSquaresPlane(points.positions) : PlaneAcross(normal);
  const Vec3 mean = MeanOf(points.positions);
  Parametrisation result{.uv = {}, .source = ParameterSource::kPlane};
  for (const Vec3& p : points.positions) {
    result.uv.emplace_back((p - mean).dot(u), (p - mean).dot(v));
  }
  Normalise(0, "the plane's u", result.uv);
  Normalise(1, "the plane's v", result.uv);
  return result;
}

struct CylinderAxis {
  Vec3 direction, across, third, centre;
  double unevenness = kNaN;  // variance of the distances from the axis over their mean square
};

// The circle of least squares (Kasa) through the points as seen along the direction is its centre.
CylinderAxis AxisAlong(const Vec3& direction, std::span<const Vec3> points) {
  CylinderAxis axis{.direction = direction.normalized(), .across = {}, .third = {}, .centre = {}};
  Eigen::Index least = 0;
  axis.direction.cwiseAbs().minCoeff(&least);
  axis.across = axis.direction.cross(Vec3::Unit(least)).normalized();
  axis.third = axis.direction.cross(axis.across);
  const Vec3 mean = MeanOf(points);
  Mat3 normal = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  for (const Vec3& p : points) {
    const Vec3 row((p - mean).dot(axis.across), (p - mean).dot(axis.third), 1);
    normal += row * row.transpose();
    right += row.head<2>().squaredNorm() * row;
  }
  const Vec3 circle = normal.ldlt().solve(right);
  const bool found = circle.allFinite();
  axis.centre = mean;
  if (found) {
    axis.centre += circle[0] / 2 * axis.across + circle[1] / 2 * axis.third;
  }
  double sum = 0, squares = 0;
  for (const Vec3& p : points) {
    const double r =
        std::hypot((p - axis.centre).dot(axis.across), (p - axis.centre).dot(axis.third));
    sum += r;
    squares += r * r;
  }
  const double n = static_cast<double>(points.size());
  axis.unevenness = 1 - sum / n * (sum / n) / (squares / n);
  return axis;
}

CylinderAxis BestAxis(const CylinderParameters& cylinder, std::span<const Vec3> points) {
  const Vec3 given(cylinder.axis[0], cylinder.axis[1], cylinder.axis[2]);
  if (given.norm() > 0) {
    return AxisAlong(given, points);
  }
  const Principal principal = PrincipalOf(points);
  CylinderAxis best = AxisAlong(principal.axes.col(2), points);
  for (const int k : {1, 0}) {
    const CylinderAxis axis = AxisAlong(principal.axes.col(k), points);
    best = axis.unevenness < best.unevenness ? axis : best;
  }
  return best;
}

Parametrisation ParametersOf(const Scattered& points, const CylinderParameters& cylinder) {
  const CylinderAxis axis = BestAxis(cylinder, points.positions);
  Parametrisation result{.uv = {}, .source = ParameterSource::kCylinder};
  for (const Vec3& p : points.positions) {
    const Vec3 x = p - axis.centre;
    const double turn = std::atan2(x.dot(axis.third), x.dot(axis.across)) / (2 * std::numbers::pi);
    result.uv.emplace_back(turn < 0 ? turn + 1 : turn, x.dot(axis.direction));
  }
  for (Vec2& uv : result.uv) {
    uv.x() = std::clamp(uv.x(), 0.0, 1.0);
  }
  Normalise(1, "the cylinder's axis", result.uv);
  return result;
}

Parametrisation ParametersOf(const Scattered& points, const AutoParameters&) {
  return points.given_uv.empty() ? ParametersOf(points, PlaneParameters{})
                                 : ParametersOf(points, GivenParameters{});
}

}  // namespace

Parametrisation Parametrise(std::span<const Vec3> positions, const Parameters& parameters,
                            std::span<const Vec2> given_uv) {
  if (positions.empty()) {
    Fail("there is no point; give some");
  }
  if (!given_uv.empty() && given_uv.size() != positions.size()) {
    Fail(fmt::format("{} pairs (u,v) for {} points; give one per point, or none", given_uv.size(),
                     positions.size()));
  }
  const Scattered points{positions, given_uv};
  return std::visit([&](const auto& p) { return ParametersOf(points, p); }, parameters);
}

}  // namespace semblance
