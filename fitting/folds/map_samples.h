// SPDX-License-Identifier: GPL-3.0-or-later
// Samples of scattered points and of a map of theirs, few enough to look at all of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "fitting/folds/plane_map.h"
#include "surfaces/base/geometry.h"

namespace semblance {

struct MapSample {
  Vec3 position = Vec3::Zero();
  Vec2 at = Vec2::Zero();
};

// Points as they are, sixty thousand at most.
std::vector<MapSample> ThinnedSamples(const PlaneMap& map);

// Means over the cubes of a lattice, over which noise is less; ordered by their places.
//   most: of them, at least 1.
std::vector<MapSample> MeanSamples(const PlaneMap& map, std::size_t most);

inline constexpr int kNearSamples = 16, kNearWithItself = kNearSamples + 1;
inline constexpr std::size_t kFewestSamples = 32;                   // that say anything
using NearestSamples = std::array<std::uint32_t, kNearWithItself>;  // itself first

// Of `count` samples those that are nearest to `own`, in order. square(n): of a distance.
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

// The plane of least squares through those around a sample.
struct SheetPlane {
  Vec3 mean = Vec3::Zero();
  Mat3 axes = Mat3::Identity();  // by spread; the first is the normal
  bool is_sheet = false;  // the sample and those around it lie on a sheet: noise and outliers
                          // do not
};
SheetPlane PlaneAround(const std::vector<MapSample>& samples, const NearestSamples& nearest);

}  // namespace semblance
