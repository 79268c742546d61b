// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/surface_poles.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace semblance {
namespace {

// Of the places of one v.
PoleGap RingAt(const HSplineSurface& surface, double v) {
  constexpr int kPerPatch = 4, kFewest = 256;
  const HSplineShape& shape = surface.shape();
  const int count = std::max(kPerPatch * shape.PatchesU(shape.max_level), kFewest);
  std::vector<Vec3> ring;
  ring.reserve(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    ring.push_back(surface.Point(Vec2((k + 0.5) / count, v)));
  }
  PoleGap gap{.place = std::accumulate(ring.begin(), ring.end(), Vec3(Vec3::Zero())) / count,
              .gap_mm = 0};
  for (const Vec3& p : ring) {
    gap.gap_mm = std::max(gap.gap_mm, (p - gap.place).norm());
  }
  return gap;
}

}  // namespace

PoleGaps PoleGapsOf(const HSplineSurface& surface) {
  return {RingAt(surface, 0), RingAt(surface, 1)};
}

bool ClosesAtPoles(const HSplineSurface& surface, const PoleGaps& gaps) {
  constexpr double kMost = 0.05;
  if (surface.shape().closure != Closure::kPeriodicU) {
    return false;
  }
  double widest_mm = 0;
  for (const double v : {0.25, 0.5, 0.75}) {
    widest_mm = std::max(widest_mm, RingAt(surface, v).gap_mm);
  }
  return std::max(gaps[0].gap_mm, gaps[1].gap_mm) < kMost * widest_mm;
}

void JoinPoles(const PoleGaps& gaps, Tessellation& tessellation) {
  for (const int v : {0, 1}) {
    JoinEdge(tessellation, v, gaps[v].place);
  }
}

}  // namespace semblance
