// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/nested_points.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "fitting/space/point_cloud.h"
#include "surfaces/hspline/bspline_basis.h"
#include "surfaces/hspline_query/hspline_batch.h"

namespace semblance {
namespace {

// A shape with levels, whose points are sorted along a Z-curve.
HSplineShape WithLevels(HSplineShape shape) {
  shape.max_level = 1;
  return shape;
}

// From the start, along x, y and z; a bounded number of points at once.
void SetDisplacements(const HSplineSurface& start, const ScatteredPoints& given, int threads,
                      NestedPoints& points) {
  constexpr std::size_t kAtOnce = 1 << 16;
  const HSplineBatch batch(start);
  std::vector<Vec2> uv;
  for (std::size_t begin = 0; begin < points.size(); begin += kAtOnce) {
    const std::size_t end = std::min(begin + kAtOnce, points.size());
    uv.clear();
    for (std::size_t k = begin; k < end; ++k) {
      uv.push_back(given.uv[points.given[k]]);
    }
    const std::vector<Vec3> on_start = batch.Points(uv, threads);
    for (std::size_t k = begin; k < end; ++k) {
      const Vec3 off = given.positions[points.given[k]] - on_start[k - begin];
      for (int c = 0; c < 3; ++c) {
        points.value[c][k] = off[c];
      }
    }
  }
}

Vec3 ValueAt(const NestedPoints& points, std::size_t k) {
  return {points.value[0][k], points.value[1][k], points.value[2][k]};
}

double Extent(const ScatteredPoints& points) {
  double largest = 0;
  for (const Vec3& p : points.positions) {
    largest = std::max(largest, p.cwiseAbs().maxCoeff());
  }
  return largest;
}

// The principal axes along which some point is off by more than rounding; at least one.
Eigen::Matrix<double, 3, Eigen::Dynamic> AxesOf(const NestedPoints& points, double extent) {
  constexpr double kRounding = 1e-12;
  Mat3 moments = Mat3::Zero();
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Vec3 d = ValueAt(points, k);
    moments += d * d.transpose();
  }
  const Mat3 all = Eigen::SelfAdjointEigenSolver<Mat3>(moments).eigenvectors();
  Vec3 largest = Vec3::Zero();
  for (std::size_t k = 0; k < points.size(); ++k) {
    largest = largest.cwiseMax((all.transpose() * ValueAt(points, k)).cwiseAbs());
  }
  int channels = 1;
  while (channels < 3 && largest[2 - channels] > kRounding * extent) {
    ++channels;
  }
  return all.rightCols(channels);
}

// From along x, y and z to along the axes.
void TurnToAxes(NestedPoints& points) {
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Vec3 d = ValueAt(points, k);
    for (int c = 0; c < points.channels; ++c) {
      points.value[c][k] = points.axes.col(c).dot(d);
    }
  }
  for (int c = points.channels; c < 3; ++c) {
    points.value[c] = {};
  }
}

}  // namespace

NestedPoints DisplacementsFrom(const HSplineSurface& start, const ScatteredPoints& given,
                               int threads) {
  const HSplineShape shape = WithLevels(start.shape());
  NestedPoints points;
  points.given = CurveOrder(shape, given);
  points.x.reserve(given.size());
  points.y.reserve(given.size());
  points.weight.reserve(given.size());
  for (const std::uint32_t k : points.given) {
    const PatchPoint at = PatchPointAt(shape, 0, given.uv[k]);
    points.x.push_back(at.patch.i + at.s);
    points.y.push_back(at.patch.j + at.t);
    points.weight.push_back(given.Weight(k));
  }
  for (std::vector<double>& value : points.value) {
    value.resize(given.size());
  }
  SetDisplacements(start, given, threads, points);
  points.axes = AxesOf(points, Extent(given));
  points.channels = static_cast<int>(points.axes.cols());
  TurnToAxes(points);
  return points;
}

NestedPlace PlaceOn(const PatchGrid& grid, int level, double x, double y) {
  const auto [i, j] = PatchOn(grid, level, x, y);
  const double scale = 1 << level;
  return {.i = i,
          .j = j,
          .along_u = CubicWeights(x * scale - i, 0),
          .along_v = CubicWeights(y * scale - j, 0)};
}

}  // namespace semblance
