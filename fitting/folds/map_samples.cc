// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/folds/map_samples.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <span>

namespace semblance::fitting {
namespace {

// Indices of every n-th point.
std::vector<std::uint32_t> ThinnedPoints(std::size_t count) {
  // Bounds the time: each of some hundred probes is compared with all samples.
  constexpr std::size_t kMostPoints = 60000;
  const std::size_t every = std::max<std::size_t>((count + kMostPoints - 1) / kMostPoints, 1);
  std::vector<std::uint32_t> points;
  for (std::size_t k = 0; k < count; k += every) {
    points.push_back(static_cast<std::uint32_t>(k));
  }
  return points;
}

std::vector<MapSample> CubeMeans(const PlaneMap& map, std::span<const std::uint32_t> points,
                                 const Vec3& corner, double edge_mm) {
  using Cube = std::array<std::int64_t, 3>;
  std::vector<std::pair<Cube, std::uint32_t>> cubes;
  cubes.reserve(points.size());
  for (const std::uint32_t k : points) {
    const Vec3 place = (map.positions[k] - corner) / edge_mm;
    cubes.push_back({{static_cast<std::int64_t>(place.x()), static_cast<std::int64_t>(place.y()),
                      static_cast<std::int64_t>(place.z())},
                     k});
  }
  std::sort(cubes.begin(), cubes.end());
  std::vector<MapSample> means;
  for (std::size_t begin = 0, end = 0; begin < cubes.size(); begin = end) {
    const Vec2& first = map.at[cubes[begin].second];
    MapSample sum;
    for (; end < cubes.size() && cubes[end].first == cubes[begin].first; ++end) {
      sum.position += map.positions[cubes[end].second];
      sum.at += Way(first, map.at[cubes[end].second], map.period_mm);
    }
    const double count = static_cast<double>(end - begin);
    means.push_back({sum.position / count, first + sum.at / count});
  }
  return means;
}

}  // namespace

std::vector<MapSample> ThinnedSamples(const PlaneMap& map) {
  std::vector<MapSample> samples;
  for (const std::uint32_t k : ThinnedPoints(map.positions.size())) {
    samples.push_back({map.positions[k], map.at[k]});
  }
  return samples;
}

std::vector<MapSample> MeanSamples(const PlaneMap& map, std::size_t most) {
  // The cubes grow until there are few enough. A smaller first cube or smaller steps only cost
  // time.
  constexpr double kFirstEdge = 1.0 / 64;  // share of the extent
  constexpr double kGrowth = 1.25;
  const std::vector<std::uint32_t> points = ThinnedPoints(map.positions.size());
  Box3 box;
  for (const std::uint32_t k : points) {
    box.extend(map.positions[k]);
  }
  for (double edge_mm = kFirstEdge * box.diagonal().norm();; edge_mm *= kGrowth) {
    std::vector<MapSample> samples = CubeMeans(map, points, box.min(), edge_mm);
    if (samples.size() <= most) {
      return samples;
    }
  }
}

NearestSamples NearestInSpace(const std::vector<MapSample>& samples, std::uint32_t own) {
  return NearestBy(static_cast<std::uint32_t>(samples.size()), own, [&](std::uint32_t n) {
    return (samples[own].position - samples[n].position).squaredNorm();
  });
}

SheetPlane PlaneAround(const std::vector<MapSample>& samples, const NearestSamples& nearest) {
  // Largest variance across a sheet, as a share of the smaller variance along it. A higher share
  // lets clouds pass as sheets; a lower one refuses sheets that bend within a neighbourhood.
  constexpr double kMostThickness = 0.15;
  // A sample within three standard deviations of its neighbours' plane is no outlier. To a sheet
  // without noise 2 % of the variance along it is added, for what it bends.
  constexpr double kMostOff = 9, kBend = 0.02;
  SheetPlane plane;
  for (int n = 1; n < kNearWithItself; ++n) {
    plane.mean += samples[nearest[n]].position / kNearSamples;
  }
  Mat3 moments = Mat3::Zero();
  for (int n = 1; n < kNearWithItself; ++n) {
    const Vec3 off = samples[nearest[n]].position - plane.mean;
    moments += off * off.transpose() / kNearSamples;
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(moments);
  const Vec3& squares = eigen.eigenvalues();
  plane.axes = eigen.eigenvectors();
  const double off = (samples[nearest[0]].position - plane.mean).dot(plane.axes.col(0));
  plane.is_sheet = squares[0] < kMostThickness * squares[1] &&
                   off * off < kMostOff * (squares[0] + kBend * squares[1]);
  return plane;
}

}  // namespace semblance::fitting
