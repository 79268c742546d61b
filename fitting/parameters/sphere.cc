// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/sphere.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "fitting/parameters/around_axis.h"
#include "fitting/parameters/principal_frame.h"
#include "surfaces/base/quantile.h"

namespace semblance {
namespace {

// Evenly over all directions, along a spiral whose steps turn by the golden angle.
std::vector<Vec3> EvenDirections(int count) {
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<Vec3> directions;
  for (int k = 0; k < count; ++k) {
    const double z = 1 - (2 * k + 1.0) / count, across = std::sqrt(1 - z * z);
    directions.emplace_back(across * std::cos(golden * k), across * std::sin(golden * k), z);
  }
  return directions;
}

std::vector<Vec3> SomeFromCentre(const PolarSphere& sphere, std::span<const Vec3> points) {
  constexpr std::size_t kMost = 5000;
  const std::size_t every = (points.size() + kMost - 1) / kMost;
  std::vector<Vec3> some;
  for (std::size_t k = 0; k < points.size(); k += every) {
    some.push_back(points[k] - sphere.centre);
  }
  return some;
}

EmptyRay RayAlong(const Vec3& direction, std::span<const Vec3> from_centre) {
  EmptyRay ray{.direction = direction, .nearest_mm = std::numeric_limits<double>::infinity()};
  std::vector<double> distances;
  distances.reserve(from_centre.size());
  for (const Vec3& x : from_centre) {
    const double along = x.dot(direction);
    distances.push_back((x - along * direction).norm());
    if (along > 0) {
      ray.nearest_mm = std::min(ray.nearest_mm, distances.back());
    }
  }
  ray.usual_mm = UpperMedian(distances);
  return ray;
}

// A point around a pole.
struct NearPole {
  std::size_t point = 0;
  double angle = kNaN;  // from the pole, over pi
  Vec2 place;           // that angle along the azimuth
};

// Those of the next points and, all round the pole, those within about twice their angle: a scan's
// rows are not cut, and there are several of them.
std::vector<NearPole> NearestToPole(std::span<const Vec2> uv, int pole) {
  constexpr std::size_t kShare = 512, kFewest = 6, kMost = 16;
  constexpr double kReach = 2.2;
  std::vector<double> angles;
  angles.reserve(uv.size());
  for (const Vec2& p : uv) {
    angles.push_back(pole == 0 ? p.y() : 1 - p.y());
  }
  std::vector<double> sorted = angles;
  const std::size_t next = std::min(uv.size(), std::clamp(uv.size() / kShare, kFewest, kMost)) - 1;
  std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(next));
  std::vector<NearPole> nearest;
  for (std::size_t k = 0; k < uv.size(); ++k) {
    if (angles[k] <= kReach * sorted[next]) {
      const double turn = 2 * std::numbers::pi * uv[k].x();
      nearest.push_back({.point = k,
                         .angle = angles[k],
                         .place = angles[k] * Vec2(std::cos(turn), std::sin(turn))});
    }
  }
  return nearest;
}

using Quadratic = Eigen::Matrix<double, 6, 1>;

Quadratic TermsAt(const Vec2& p) {
  return (Quadratic() << 1, p.x(), p.y(), p.x() * p.x(), p.x() * p.y(), p.y() * p.y()).finished();
}

// Of what the points have, `values`, one per point around the pole.
std::vector<double> MissesOf(const Quadratic& coefficients, const std::vector<NearPole>& nearest,
                             std::span<const double> values, double reach) {
  std::vector<double> misses;
  misses.reserve(nearest.size());
  for (std::size_t k = 0; k < nearest.size(); ++k) {
    misses.push_back(std::abs(values[k] - coefficients.dot(TermsAt(nearest[k].place / reach))));
  }
  return misses;
}

Quadratic QuadraticThrough(const std::vector<NearPole>& nearest, std::span<const double> values,
                           std::span<const double> weights, double reach) {
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Quadratic right = Quadratic::Zero();
  for (std::size_t k = 0; k < nearest.size(); ++k) {
    const Quadratic terms = TermsAt(nearest[k].place / reach);
    normal += weights[k] * terms * terms.transpose();
    right += weights[k] * values[k] * terms;
  }
  return normal.completeOrthogonalDecomposition().solve(right);
}

double ValueAtPole(const std::vector<NearPole>& nearest, std::span<const double> values) {
  constexpr int kRounds = 8;
  constexpr double kWidth = 4.685 * 1.4826;  // 95 % efficient for normal errors
  double reach = 1e-300;
  for (const NearPole& p : nearest) {
    reach = std::max(reach, p.angle);
  }
  std::vector<double> weights(nearest.size(), 1);
  Quadratic quadratic = QuadraticThrough(nearest, values, weights, reach);
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<double> misses = MissesOf(quadratic, nearest, values, reach);
    std::vector<double> sorted = misses;
    const double width =
        std::max({kWidth * UpperMedian(sorted), 1e-12 * std::abs(quadratic[0]), 1e-300});
    for (std::size_t k = 0; k < nearest.size(); ++k) {
      const double off = std::min(misses[k] / width, 1.0);
      weights[k] = (1 - off * off) * (1 - off * off);
    }
    quadratic = QuadraticThrough(nearest, values, weights, reach);
  }
  return quadratic[0];
}

template <class ValueOf>
double ValueAtPole(const std::vector<NearPole>& nearest, const ValueOf& value_of) {
  std::vector<double> values;
  values.reserve(nearest.size());
  for (const NearPole& p : nearest) {
    values.push_back(value_of(p.point));
  }
  return ValueAtPole(nearest, std::span<const double>(values));
}

}  // namespace

PolarSphere SphereThrough(std::span<const Vec3> points, const Vec3& axis) {
  const Vec3 mean = MeanPoint(points);
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (const Vec3& p : points) {
    const Vec3 x = p - mean;
    const Eigen::Vector4d row(x.x(), x.y(), x.z(), 1);
    normal += row * row.transpose();
    right += x.squaredNorm() * row;
  }
  const Eigen::Vector4d found = normal.ldlt().solve(right);
  const Vec3 centre = found.head<3>() / 2;
  return {.centre = mean + centre,
          .axis = axis.normalized(),
          .radius_mm = std::sqrt(found[3] + centre.squaredNorm())};
}

std::vector<Vec2> AnglesAbout(const PolarSphere& sphere, std::span<const Vec3> points) {
  const auto [a, b] = Across(sphere.axis);
  std::vector<Vec2> angles;
  angles.reserve(points.size());
  for (const Vec3& p : points) {
    const Vec3 x = p - sphere.centre;
    const double along = x.dot(sphere.axis), ahead = x.dot(a), aside = x.dot(b);
    angles.emplace_back(Turns(aside, ahead),
                        std::atan2(std::hypot(ahead, aside), -along) / std::numbers::pi);
  }
  return angles;
}

EmptyRay WidestRay(const PolarSphere& sphere, std::span<const Vec3> points,
                   std::span<const Vec3> directions) {
  constexpr int kTried = 400;
  std::vector<Vec3> tried = EvenDirections(kTried);
  for (const Vec3& direction : directions) {
    tried.push_back(direction);
    tried.push_back(-direction);
  }
  const std::vector<Vec3> from_centre = SomeFromCentre(sphere, points);
  EmptyRay widest;
  for (const Vec3& direction : tried) {
    const EmptyRay ray = RayAlong(direction, from_centre);
    if (!(ray.Width() <= widest.Width())) {
      widest = ray;
    }
  }
  return widest;
}

Poles PolesOf(const PolarSphere& sphere, std::span<const Vec3> points, std::span<const Vec2> uv) {
  const auto distance = [&](std::size_t k) { return (points[k] - sphere.centre).norm(); };
  Poles poles;
  for (const int pole : {0, 1}) {
    const double sense = pole == 0 ? -1 : 1;
    poles[pole] =
        sphere.centre + sense * ValueAtPole(NearestToPole(uv, pole), distance) * sphere.axis;
  }
  return poles;
}

Poles PolesAmong(std::span<const Vec3> points, std::span<const Vec2> uv) {
  Poles poles;
  for (const int pole : {0, 1}) {
    const std::vector<NearPole> nearest = NearestToPole(uv, pole);
    for (const int c : {0, 1, 2}) {
      poles[pole][c] = ValueAtPole(nearest, [&](std::size_t k) { return points[k][c]; });
    }
  }
  return poles;
}

}  // namespace semblance
