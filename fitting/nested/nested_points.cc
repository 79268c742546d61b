// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/nested_points.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "surfaces/hspline/bspline_basis.h"
#include "surfaces/hspline_query/hspline_batch.h"

namespace semblance {
namespace {

std::vector<Vec3> OffStart(const HSplineSurface& start, const PointCloud& cloud, int threads) {
  std::vector<Vec2> uv;
  uv.reserve(cloud.points().size());
  for (const CloudPoint& p : cloud.points()) {
    uv.emplace_back(p.x / start.shape().patches_u, p.y / start.shape().patches_v);
  }
  std::vector<Vec3> off = HSplineBatch(start).Points(uv, threads);
  for (std::size_t k = 0; k < off.size(); ++k) {
    const auto& p = cloud.points()[k].position;
    off[k] = Vec3(p[0], p[1], p[2]) - off[k];
  }
  return off;
}

// Of the points, from their mean.
double Extent(const PointCloud& cloud) {
  double largest = 0;
  for (const CloudPoint& p : cloud.points()) {
    largest = std::max(
        {largest, std::abs(p.position[0]), std::abs(p.position[1]), std::abs(p.position[2])});
  }
  return largest;
}

// The principal axes along which some point is off by more than rounding; at least one.
Eigen::Matrix<double, 3, Eigen::Dynamic> AxesOf(const std::vector<Vec3>& off, double extent) {
  constexpr double kRounding = 1e-12;
  Mat3 moments = Mat3::Zero();
  for (const Vec3& d : off) {
    moments += d * d.transpose();
  }
  const Mat3 all = Eigen::SelfAdjointEigenSolver<Mat3>(moments).eigenvectors();
  Vec3 largest = Vec3::Zero();
  for (const Vec3& d : off) {
    largest = largest.cwiseMax((all.transpose() * d).cwiseAbs());
  }
  int channels = 1;
  while (channels < 3 && largest[2 - channels] > kRounding * extent) {
    ++channels;
  }
  return all.rightCols(channels);
}

}  // namespace

NestedPoints DisplacementsFrom(const HSplineSurface& start, const PointCloud& cloud, int threads) {
  const std::vector<Vec3> off = OffStart(start, cloud, threads);
  NestedPoints points;
  points.axes = AxesOf(off, Extent(cloud));
  points.channels = static_cast<int>(points.axes.cols());
  for (std::size_t k = 0; k < off.size(); ++k) {
    const CloudPoint& p = cloud.points()[k];
    points.x.push_back(p.x);
    points.y.push_back(p.y);
    points.weight.push_back(p.weight);
    points.given.push_back(static_cast<std::uint32_t>(cloud.Given(k)));
    for (int c = 0; c < points.channels; ++c) {
      points.value[c].push_back(points.axes.col(c).dot(off[k]));
    }
  }
  return points;
}

NestedPlace PlaceOn(const PatchGrid& grid, int level, double x, double y) {
  const double scale = 1 << level, s = x * scale, t = y * scale;
  NestedPlace place{.i = std::clamp(static_cast<int>(s), 0, grid.patches_u - 1),
                    .j = std::clamp(static_cast<int>(t), 0, grid.patches_v - 1),
                    .along_u = {},
                    .along_v = {}};
  place.along_u = CubicWeights(s - place.i, 0);
  place.along_v = CubicWeights(t - place.j, 0);
  return place;
}

}  // namespace semblance
