// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/map_candidate.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

constexpr double kNextToNone = 0.003;  // share of the points

}  // namespace

MapFaults MapFaultsOf(const Scan& points, const MapCandidate& candidate) {
  const PlaneMap map{points.positions, candidate.at, candidate.period_mm};
  const MapFaults by_points = FaultsOfPoints(map);
  if (points.triangles.empty()) {
    return by_points;
  }
  MapFaults by_triangles = FaultsOfTriangles(map, points.triangles);
  if (by_triangles.Sum() > kMostFaults) {
    const MapFaults beyond_noise = FaultsBeyondNoise(map, points.triangles);
    by_triangles = beyond_noise.Sum() < by_triangles.Sum() ? beyond_noise : by_triangles;
  }
  return {.folded = std::max(by_points.folded, by_triangles.folded),
          .collapsed = std::max(by_points.collapsed, by_triangles.collapsed),
          .mirrored = by_triangles.mirrored};
}

bool MayBeTaken(const MapCandidate& candidate, FoldRule folds) {
  return folds == FoldRule::kAccept || candidate.faults.Sum() <= kMostFaults;
}

std::vector<MapCandidate> ChooseCandidate(const Scan& points, int count,
                                          const std::function<MapCandidate(int)>& make) {
  std::vector<MapCandidate> tried;
  for (int k = 0; k < count && (k == 0 || tried.back().faults.Sum() > kNextToNone); ++k) {
    MapCandidate next = make(k);
    next.number = k;
    next.faults = MapFaultsOf(points, next);
    const bool better = k == 0 || next.faults.Sum() < tried.back().faults.Sum();
    const auto at = tried.insert(better ? tried.end() : tried.end() - 1, std::move(next));
    if (k > 0) {
      (better ? at - 1 : at)->at = {};
    }
  }
  return tried;
}

std::string FaultsText(const std::vector<MapCandidate>& tried) {
  std::string text;
  for (const MapCandidate& candidate : tried) {
    text += fmt::format("{}{} of them over {}", text.empty() ? "" : ", ",
                        PercentText(candidate.faults.Sum()), candidate.how);
  }
  return text;
}

std::string PercentText(double share) { return fmt::format("{:.3g} %", 100 * share); }

void FailParameters(const std::string& what) { throw InputError("parameters: " + what); }

void Normalise(int coordinate, const std::string& what, std::vector<Vec2>& uv) {
  double low = uv.front()[coordinate], high = low;
  for (const Vec2& p : uv) {
    low = std::min(low, p[coordinate]);
    high = std::max(high, p[coordinate]);
  }
  if (!(high > low)) {
    FailParameters(
        fmt::format("the points have no extent along {}; give (u,v), or other points", what));
  }
  for (Vec2& p : uv) {
    p[coordinate] = std::clamp((p[coordinate] - low) / (high - low), 0.0, 1.0);
  }
}

void TurnToTriangles(const MapFaults& faults, int coordinate, std::vector<Vec2>& at) {
  for (Vec2& p : at) {
    p[coordinate] *= faults.mirrored ? -1 : 1;
  }
}

}  // namespace semblance
