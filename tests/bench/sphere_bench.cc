// SPDX-License-Identifier: GPL-3.0-or-later
// Closed surfaces by `parameters: sphere`, over all and at their poles; the peer is the same fit of
// the same (u,v) as given ones, which knows of no poles.
#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "problems/points/point_fit.h"
#include "tests/bench/fit_measure.h"
#include "tests/testing/stone.h"

namespace semblance::bench {
namespace {

struct Closed {
  double rms_mm = kNaN, pole_rms_mm = kNaN, gap_mm = kNaN;
};

Closed Measure(const HSplineSurface& surface, const testing::RadiusAlong& radius) {
  constexpr double kPole = 1.0 / 18;  // ten degrees
  Closed closed{.rms_mm = testing::ErrorsOfRings(surface, radius, 0, 1).rms,
                .pole_rms_mm = std::max(testing::ErrorsOfRings(surface, radius, 0, kPole).rms,
                                        testing::ErrorsOfRings(surface, radius, 1, 1 - kPole).rms),
                .gap_mm = 0};
  for (const PoleGap& pole : PoleGapsOf(surface)) {
    closed.gap_mm = std::max(closed.gap_mm, pole.gap_mm);
  }
  return closed;
}

void RunOne(const std::string& name, const testing::RadiusAlong& radius, int count, double noise) {
  PointTable table;
  table.positions = testing::PointsAround(radius, count, noise);
  PointFitOptions options;
  options.closure = Closure::kPeriodicU;
  options.parameters = SphereParameters{};
  const PointFit fit = FitPoints(table, options, {});
  table.uv = fit.fit.uv;
  options.parameters = GivenParameters{};
  const Closed ours = Measure(fit.fit.surface, radius),
               plain = Measure(FitPoints(table, options, {}).fit.surface, radius);
  const std::string entry = fmt::format("fit.sphere.{}_{}_noise_{:g}", name, count, noise);
  Print(entry + "_rms", ours.rms_mm, plain.rms_mm, kNaN, "mm");
  Print(entry + "_pole_rms", ours.pole_rms_mm, plain.pole_rms_mm, kNaN, "mm");
  Print(entry + "_gap", ours.gap_mm, plain.gap_mm, kNaN, "mm");
}

void RunAll() {
  for (const double noise : {0.0, 1e-3}) {
    RunOne("ball", testing::BallRadius, 10000, noise);
    RunOne("stone", testing::StoneRadius, 10000, noise);
  }
  RunOne("ball", testing::BallRadius, 100000, 1e-3);
  RunOne("stone", testing::StoneRadius, 100000, 1e-3);
}

}  // namespace
}  // namespace semblance::bench

int main() { semblance::bench::RunAll(); }
