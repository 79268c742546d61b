// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/torus_parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "fitting/parameters/torus.h"
#include "surfaces/base/geometry.h"

namespace semblance {
namespace {

// The widest part of a turn in which no value lies.
double WidestGap(std::vector<double> turns) {
  std::sort(turns.begin(), turns.end());
  double widest = turns.front() + 1 - turns.back();
  for (std::size_t k = 1; k < turns.size(); ++k) {
    widest = std::max(widest, turns[k] - turns[k - 1]);
  }
  return widest;
}

// A sphere, a tube or a cloud has a nearest torus too.
void CheckTorus(const Torus& torus, const std::vector<Vec2>& turns) {
  constexpr double kMostGap = 0.25, kMostOff = 0.35;  // turns, tube radii
  std::vector<double> u, v;
  for (const Vec2& p : turns) {
    u.push_back(p.x());
    v.push_back(p.y());
  }
  const double gap_u = WidestGap(std::move(u)), gap_v = WidestGap(std::move(v));
  const bool is_torus = torus.tube_mm > 0 && torus.ring_mm > torus.tube_mm &&
                        torus.median_off_mm < kMostOff * torus.tube_mm && gap_u < kMostGap &&
                        gap_v < kMostGap;
  if (!is_torus) {
    FailParameters(fmt::format(
        "the points are not a torus: the nearest has a ring of radius {:.4g} mm and a tube of "
        "{:.4g} mm, half of the points are more than {:.3g} mm off it, and its widest gaps are {} "
        "of a "
        "turn around the axis and {} around the ring; give another axis, or u and v",
        std::abs(torus.ring_mm), std::abs(torus.tube_mm), torus.median_off_mm, PercentText(gap_u),
        PercentText(gap_v)));
  }
}

}  // namespace

Parametrisation ParametriseBy(const Scan& points, const TorusParameters& asked) {
  const Vec3 axis(asked.axis[0], asked.axis[1], asked.axis[2]);
  if (!axis.allFinite()) {
    FailParameters("the torus's axis is not finite; give three numbers");
  }
  const Torus torus = TorusThrough(points.positions, axis);
  std::vector<Vec2> turns = TurnsAround(torus, points.positions);
  CheckTorus(torus, turns);
  MapCandidate best{
      .how =
          fmt::format("the torus around [{:.3g}, {:.3g}, {:.3g}] of radii {:.4g} and {:.4g} mm",
                      torus.axis.x(), torus.axis.y(), torus.axis.z(), torus.ring_mm, torus.tube_mm),
      .at = turns,
      .period_mm = 2 * std::numbers::pi * Vec2(torus.ring_mm, torus.tube_mm)};
  for (Vec2& p : best.at) {
    p = p.cwiseProduct(best.period_mm);
  }
  best.faults = MapFaultsOf(points, best);
  if (!MayBeTaken(best, asked.folds)) {
    FailParameters(
        fmt::format("the points fold over the torus: {}; give another axis, or u and v; or write "
                    "folds: accept",
                    FaultsText({best})));
  }
  for (Vec2& p : turns) {
    p.y() = best.faults.mirrored ? 1 - p.y() : p.y();
  }
  return {.uv = std::move(turns),
          .source = ParameterSource::kTorus,
          .how = best.how,
          .faults = best.faults};
}

}  // namespace semblance
