// SPDX-License-Identifier: GPL-3.0-or-later
// A map of scattered points to the plane, and samples of it that are few enough to compare each
// with all others.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::fitting {

// Positions and places are both in mm, so that lengths can be compared.
struct PlaneMap {
  std::span<const Vec3> positions;
  std::span<const Vec2> at;  // one per position
  double period_mm = 0;  // length once round along the first coordinate; 0: it does not go round
};

// The way from one place to another, the shorter way round.
inline Vec2 Way(const Vec2& from, const Vec2& to, double period_mm) {
  Vec2 way = to - from;
  if (period_mm > 0) {
    way.x() -= period_mm * std::round(way.x() / period_mm);
  }
  return way;
}

struct MapSample {
  Vec3 position = Vec3::Zero();
  Vec2 at = Vec2::Zero();
};

// Every n-th point as it is, at most 60,000.
std::vector<MapSample> ThinnedSamples(const PlaneMap& map);

// Means over the cubes of a lattice, which have less noise than the points; ordered by their
// places.
//   most: largest number of means, at least 1.
std::vector<MapSample> MeanSamples(const PlaneMap& map, std::size_t most);

inline constexpr int kNearSamples = 16, kNearWithItself = kNearSamples + 1;
inline constexpr std::size_t kFewestSamples = 32;  // twice a neighbourhood: fewer say nothing
using NearestSamples = std::array<std::uint32_t, kNearWithItself>;  // the sample itself first

// Returns the sample `own` and the nearest others among `count` samples, in order of their
// distance. square(n): squared distance of sample n from `own`.
template <class Square>
NearestSamples NearestBy(std::uint32_t count, std::uint32_t own, const Square& square) {
  std::array<std::pair<double, std::uint32_t>, kNearWithItself> best;
  best.fill({std::numeric_limits<double>::infinity(), own});
  best[0].first = -1;
  for (std::uint32_t n = 0; n < count; ++n) {
    const double next = square(n);
    if (n != own && next < best.back().first) {
      int at = kNearSamples;
      for (; best[at - 1].first > next; --at) {
        best[at] = best[at - 1];
      }
      best[at] = {next, n};
    }
  }
  NearestSamples nearest;
  for (int k = 0; k < kNearWithItself; ++k) {
    nearest[k] = best[k].second;
  }
  return nearest;
}

NearestSamples NearestInSpace(const std::vector<MapSample>& samples, std::uint32_t own);

// The plane of least squares through the neighbours of a sample.
struct SheetPlane {
  Vec3 mean = Vec3::Zero();
  Mat3 axes = Mat3::Identity();  // columns by ascending spread; the first is the normal
  bool is_sheet = false;  // the sample and its neighbours lie on a sheet; false in noise, and
                          // for an outlier
};
SheetPlane PlaneAround(const std::vector<MapSample>& samples, const NearestSamples& nearest);

}  // namespace semblance::fitting
