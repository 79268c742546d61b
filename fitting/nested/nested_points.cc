// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/nested_points.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include "fitting/space/point_cloud.h"
#include "surfaces/hspline_query/hspline_batch.h"

namespace semblance::fitting {
namespace {

// The shape with more than one level, so that CurveOrder sorts along a Z-curve.
HSplineShape WithLevels(HSplineShape shape) {
  shape.max_level = 1;
  return shape;
}

// Permutes in place, so that the row at order[k] moves to k. It handles one column at a time to
// save memory.
template <class Row>
void SortBy(std::span<const std::uint32_t> order, std::vector<Row>& rows) {
  std::vector<double> column(rows.size());
  for (Eigen::Index c = 0; c < Row::RowsAtCompileTime; ++c) {
    for (std::size_t k = 0; k < rows.size(); ++k) {
      column[k] = rows[order[k]][c];
    }
    for (std::size_t k = 0; k < rows.size(); ++k) {
      rows[k][c] = column[k];
    }
  }
}

// Turns positions into displacements from the start, for a bounded number of points at a time.
void SubtractStart(const HSplineSurface& start, std::span<const Vec2> uv, int threads,
                   std::vector<Vec3>& positions) {
  constexpr std::size_t kAtOnce = 1 << 16;  // bounds the memory
  const HSplineBatch batch(start);
  for (std::size_t begin = 0; begin < uv.size(); begin += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, uv.size() - begin);
    const std::vector<Vec3> on_start = batch.Points(uv.subspan(begin, count), threads);
    for (std::size_t k = 0; k < count; ++k) {
      positions[begin + k] -= on_start[k];
    }
  }
}

double Extent(std::span<const Vec3> positions) {
  double largest = 0;
  for (const Vec3& p : positions) {
    largest = std::max(largest, p.cwiseAbs().maxCoeff());
  }
  return largest;
}

// The principal axes along which some displacement exceeds round-off; at least one.
Eigen::Matrix<double, 3, Eigen::Dynamic> PrincipalAxes(const NestedPoints& points, double extent) {
  constexpr double kRelativeRounding = 1e-12;  // relative to the extent
  Mat3 moments = Mat3::Zero();
  for (const Vec3& d : points.value) {
    moments += d * d.transpose();
  }
  const Mat3 all = Eigen::SelfAdjointEigenSolver<Mat3>(moments).eigenvectors();
  Vec3 largest = Vec3::Zero();
  for (const Vec3& d : points.value) {
    largest = largest.cwiseMax((all.transpose() * d).cwiseAbs());
  }
  int channels = 1;
  while (channels < 3 && largest[2 - channels] > kRelativeRounding * extent) {
    ++channels;
  }
  return all.rightCols(channels);
}

// Moves copies of points to points.repeated. Copies are adjacent on the curve.
void SeparateCopies(NestedPoints& points) {
  const auto is_copy = [&](std::size_t a, std::size_t b) {
    return points.uv[a] == points.uv[b] && points.value[a] == points.value[b] &&
           points.Weight(a) == points.Weight(b);
  };
  std::size_t kept = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (k > 0 && is_copy(k, kept - 1)) {
      points.repeated.push_back({points.given[k], points.given[kept - 1], points.Weight(k)});
      continue;
    }
    points.uv[kept] = points.uv[k];
    points.value[kept] = points.value[k];
    points.given[kept] = points.given[k];
    if (!points.weight.empty()) {
      points.weight[kept] = points.weight[k];
    }
    ++kept;
  }
  points.uv.resize(kept);
  points.value.resize(kept);
  points.given.resize(kept);
  points.weight.resize(points.weight.empty() ? 0 : kept);
}

// Turns displacements along x, y and z into displacements along the axes.
void TurnToAxes(NestedPoints& points) {
  for (Vec3& value : points.value) {
    const Vec3 d = value;
    value.setZero();
    for (int c = 0; c < points.channels; ++c) {
      value[c] = points.axes.col(c).dot(d);
    }
  }
}

}  // namespace

// If all weights are equal, the mean is exactly this weight, so that equal weights have no effect.
void NestedPoints::UpdateMeanWeight(const std::vector<char>& left_out) {
  double sum = 0, least = std::numeric_limits<double>::infinity(), most = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < weight.size(); ++k) {
    if (left_out.empty() || left_out[k] == 0) {
      sum += weight[k];
      least = std::min(least, weight[k]);
      most = std::max(most, weight[k]);
      ++count;
    }
  }
  if (count > 0) {
    mean_weight = least == most ? most : sum / static_cast<double>(count);
  }
}

NestedPoints TakeDisplacements(const HSplineSurface& start, OwnedPoints given, int threads) {
  const HSplineShape shape = WithLevels(start.shape());
  const double extent = Extent(given.positions);
  NestedPoints points;
  points.patches = Vec2(shape.patches_u, shape.patches_v);
  points.periodic_u = shape.ClosedU();
  points.given = CurveOrder(shape, given.View());
  SubtractStart(start, given.uv, threads, given.positions);
  points.value = std::move(given.positions);
  points.uv = std::move(given.uv);
  SortBy(points.given, points.value);
  SortBy(points.given, points.uv);
  points.weight.reserve(given.weights.size());
  for (std::size_t k = 0; k < given.weights.size(); ++k) {
    points.weight.push_back(given.weights[points.given[k]]);
  }
  SeparateCopies(points);
  points.UpdateMeanWeight({});
  points.weighted =
      std::ranges::any_of(points.weight, [&](double weight) { return weight != points.weight[0]; });
  points.axes = PrincipalAxes(points, extent);
  points.channels = static_cast<int>(points.axes.cols());
  TurnToAxes(points);
  return points;
}

NestedPoints DisplacementsFrom(const HSplineSurface& start, const ScatteredPoints& given,
                               int threads) {
  return TakeDisplacements(
      start,
      OwnedPoints{.positions = {given.positions.begin(), given.positions.end()},
                  .uv = {given.uv.begin(), given.uv.end()},
                  .weights = {given.weights.begin(), given.weights.end()}},
      threads);
}

std::vector<Vec2> UvAsGiven(NestedPoints points) {
  points.value = std::vector<Vec3>();  // frees it, which {} would not
  points.weight = std::vector<double>();
  const std::size_t kept = points.size();
  std::vector<double> column(points.GivenSize());
  points.uv.resize(column.size());
  for (const int c : {0, 1}) {
    for (std::size_t k = 0; k < kept; ++k) {
      column[points.given[k]] = points.uv[k][c];
    }
    for (const RepeatedPoint& copy : points.repeated) {
      column[copy.given] = column[copy.first];
    }
    for (std::size_t k = 0; k < column.size(); ++k) {
      points.uv[k][c] = column[k];
    }
  }
  return std::move(points.uv);
}

}  // namespace semblance::fitting
