// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/torus.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "fitting/parameters/around_axis.h"
#include "surfaces/base/quantile.h"

namespace semblance {
namespace {

// Centre, tilt of the axis, radii of ring and tube.
using Seven = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

enum class Axis { kTurns, kStays };

std::vector<Vec3> Thinned(std::span<const Vec3> points, std::size_t most) {
  const std::size_t every = (points.size() + most - 1) / most;
  std::vector<Vec3> some;
  for (std::size_t k = 0; k < points.size(); k += every) {
    some.push_back(points[k]);
  }
  return some;
}

// m and a of values m + a cos(angle), angles being even, but for a share of them at either end.
std::array<double, 2> MiddleAndReach(std::vector<double> values, double share) {
  const double low = Quantile(values, share), high = Quantile(values, 1 - share);
  return {(low + high) / 2, (high - low) / (2 * std::cos(std::numbers::pi * share))};
}

// A point's place about the ring.
struct Place {
  Vec3 outward;  // unit, from the axis
  double height = 0, beyond = 0, from_ring = 0;
};

Place PlaceOf(const Torus& torus, const Vec3& point) {
  const Vec3 x = point - torus.centre;
  const double height = x.dot(torus.axis);
  const Vec3 across = x - height * torus.axis;
  const double distance = across.norm(), beyond = distance - torus.ring_mm;
  return {.outward = distance > 0 ? Vec3(across / distance) : Vec3(Vec3::Zero()),
          .height = height,
          .beyond = beyond,
          .from_ring = std::hypot(beyond, height)};
}

std::vector<double> OffFrom(const Torus& torus, std::span<const Vec3> points) {
  std::vector<double> off;
  off.reserve(points.size());
  for (const Vec3& point : points) {
    off.push_back(PlaceOf(torus, point).from_ring - torus.tube_mm);
  }
  return off;
}

double MedianOf(std::vector<double> off) {
  for (double& value : off) {
    value = std::abs(value);
  }
  return Quantile(off, 0.5);
}

// Derivatives of how far a point is off.
Seven SlopeOf(const Torus& torus, const std::array<Vec3, 2>& across, const Place& place) {
  const double length = std::max(place.from_ring, 1e-300);
  const Vec3 away = (place.beyond * place.outward + place.height * torus.axis) / length;
  const Vec3 tilt = torus.ring_mm * place.height / length * place.outward;
  Seven slope;
  slope << -away, tilt.dot(across[0]), tilt.dot(across[1]), -place.beyond / length, -1;
  return slope;
}

Torus Moved(const Torus& torus, const std::array<Vec3, 2>& across, const Seven& step) {
  Torus moved = torus;
  moved.centre += step.head<3>();
  moved.axis = (torus.axis + step[3] * across[0] + step[4] * across[1]).normalized();
  moved.ring_mm += step[5];
  moved.tube_mm += step[6];
  return moved;
}

// Cauchy's, of distances whose median is given.
std::vector<double> WeightsOf(const std::vector<double>& off, double median) {
  constexpr double kWidth = 2.385 * 1.4826;  // 95 % efficient for normal errors
  const double width = std::max(kWidth * median, 1e-300);
  std::vector<double> weights;
  weights.reserve(off.size());
  for (const double value : off) {
    weights.push_back(1 / (1 + value / width * (value / width)));
  }
  return weights;
}

double Sum(const std::vector<double>& weights, const std::vector<double>& off) {
  double sum = 0;
  for (std::size_t k = 0; k < off.size(); ++k) {
    sum += weights[k] * off[k] * off[k];
  }
  return sum;
}

struct NormalEquations {
  Matrix7 matrix = Matrix7::Zero();
  Seven right = Seven::Zero();
};

NormalEquations EquationsAt(const Torus& torus, const std::array<Vec3, 2>& across,
                            std::span<const Vec3> points, const std::vector<double>& weights,
                            Axis axis) {
  NormalEquations sum;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Place place = PlaceOf(torus, points[k]);
    Seven slope = SlopeOf(torus, across, place);
    slope.segment<2>(3) *= axis == Axis::kTurns ? 1 : 0;
    sum.matrix += weights[k] * slope * slope.transpose();
    sum.right -= weights[k] * (place.from_ring - torus.tube_mm) * slope;
  }
  return sum;
}

Torus Nearest(Torus torus, std::span<const Vec3> points, Axis axis, int most_steps) {
  constexpr double kStill = 1e-10;  // of a step, beside the radii
  double damping = 1e-3;
  std::vector<double> off = OffFrom(torus, points);
  for (int step = 0; step < most_steps && damping < 1e12; ++step) {
    const std::vector<double> weights = WeightsOf(off, MedianOf(off));
    const std::array<Vec3, 2> across = Across(torus.axis);
    NormalEquations equations = EquationsAt(torus, across, points, weights, axis);
    equations.matrix.diagonal() *= 1 + damping;
    equations.matrix.diagonal().array() += 1e-12 * equations.matrix.trace();
    const Seven way = equations.matrix.ldlt().solve(equations.right);
    const Torus next = Moved(torus, across, way);
    std::vector<double> next_off = OffFrom(next, points);
    if (!(Sum(weights, next_off) < Sum(weights, off))) {
      damping *= 10;
      continue;
    }
    damping = std::max(damping / 10, 1e-12);
    torus = next;
    off = std::move(next_off);
    if (way.norm() < kStill * (std::abs(torus.ring_mm) + std::abs(torus.tube_mm))) {
      break;
    }
  }
  torus.median_off_mm = MedianOf(off);
  return torus;
}

// By the extents of the points, less a share of them at either end.
Torus StartAlong(const Vec3& axis, std::span<const Vec3> points, double share) {
  Torus torus{.centre = Vec3::Zero(), .axis = axis.normalized()};
  const std::array<Vec3, 2> across = Across(torus.axis);
  for (const Vec3& direction : {torus.axis, across[0], across[1]}) {
    std::vector<double> along;
    for (const Vec3& point : points) {
      along.push_back(point.dot(direction));
    }
    torus.centre += MiddleAndReach(std::move(along), share)[0] * direction;
  }
  std::vector<double> distances;
  for (const Vec3& point : points) {
    const Vec3 x = point - torus.centre;
    distances.push_back((x - x.dot(torus.axis) * torus.axis).norm());
  }
  const auto [middle, reach] = MiddleAndReach(std::move(distances), share);
  torus.ring_mm = middle;
  torus.tube_mm = reach;
  return torus;
}

std::vector<Vec3> PrincipalAxes(std::span<const Vec3> points) {
  Vec3 mean = Vec3::Zero();
  for (const Vec3& point : points) {
    mean += point / static_cast<double>(points.size());
  }
  Mat3 moments = Mat3::Zero();
  for (const Vec3& point : points) {
    moments += (point - mean) * (point - mean).transpose();
  }
  const Mat3 axes = Eigen::SelfAdjointEigenSolver<Mat3>(moments).eigenvectors();
  return {axes.col(0), axes.col(1), axes.col(2)};
}

// With its largest entry positive, so that no sign is left to chance.
Vec3 Signed(const Vec3& axis) {
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  return axis[largest] < 0 ? Vec3(-axis) : axis;
}

}  // namespace

Torus TorusThrough(std::span<const Vec3> points, const Vec3& axis) {
  constexpr std::size_t kSome = 1000, kMany = 10000;
  constexpr int kFewSteps = 60, kManySteps = 200;
  const std::vector<Vec3> some = Thinned(points, kSome);
  const bool given = !axis.isZero(0);
  const Axis way = given ? Axis::kStays : Axis::kTurns;
  Torus best;
  for (const double share : {0.02, 0.25}) {  // the second for outliers
    for (const Vec3& start : given ? std::vector<Vec3>{axis} : PrincipalAxes(some)) {
      const Torus next = Nearest(StartAlong(start, some, share), some, way, kFewSteps);
      if (!(next.median_off_mm >= best.median_off_mm)) {
        best = next;
      }
    }
  }
  best = Nearest(best, Thinned(points, kMany), way, kManySteps);
  best.axis = given ? best.axis : Signed(best.axis);
  return best;
}

std::vector<Vec2> TurnsAround(const Torus& torus, std::span<const Vec3> points) {
  const auto [a, b] = Across(torus.axis);
  std::vector<Vec2> turns;
  turns.reserve(points.size());
  for (const Vec3& point : points) {
    const Place place = PlaceOf(torus, point);
    turns.emplace_back(Turns(place.outward.dot(b), place.outward.dot(a)),
                       Turns(place.height, place.beyond));
  }
  return turns;
}

}  // namespace semblance
