// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "fitting/fit.h"
#include "tests/bench/fit_parts.h"
#include "tests/testing/scattered_data.h"

namespace semblance::bench {
using namespace problems;

Measured MeasureHead(int count, double tolerance, Solver solver) {
  const HSplineShape shape{
      .patches_u = 8, .patches_v = 8, .max_level = 5, .closure = Closure::kPeriodicU};
  const HSplineSurface start = testing::PlainStart(shape);
  const FitTarget target = testing::Scattered(testing::HeadPoint, count, 1e-4, 206);
  const double begin = CpuSecondsSoFar();
  const FitResult result = Fit(start, target, {},
                               {.plan = AdaptivePlan{.tolerance_mm = tolerance, .finest = 5},
                                .terms = {PointTerm{}},
                                .solver = solver},
                               {});
  Measured measured;
  measured.seconds = CpuSecondsSoFar() - begin;
  measured.peak_mb = PeakMb();
  const testing::CleanError error = testing::ErrorAgainst(testing::HeadPoint, result.surface);
  measured.rms_mm = error.rms;
  measured.largest_mm = error.largest;
  measured.vertices = static_cast<double>(start.Columns(0) * start.Rows(0)) +
                      static_cast<double>(result.surface.Offsets().size());
  return measured;
}

// Goals: G+Smo's and GoTools' figures on the same surface (G+Smo 276 s, 1,456 vertices, RMS 5.9e-5,
// largest 8.3e-4; GoTools 100 s, 1,077 vertices, 220 MB; at 1e5 points RMS 7.4e-5), at least 50
// times as fast as the faster one, with at most twice the vertices of the sparser one.
void RunHead() {
  const auto measure = [](int count, double tolerance, Solver solver) {
    return MeasureApart([=] { return MeasureHead(count, tolerance, solver); });
  };
  const Measured few = measure(10000, 1.5e-3, Solver::kFastest),
                 some = measure(100000, 9e-4, Solver::kFastest),
                 many = measure(1000000, 8e-4, Solver::kFastest),
                 few_by_ceres = measure(10000, 1.5e-3, Solver::kCeres),
                 some_by_ceres = measure(100000, 9e-4, Solver::kCeres);
  Print("fit.head_1e6_adaptive_seconds", many.seconds, kNaN, 2.0, "s");
  Print("fit.head_1e6_adaptive_rms", many.rms_mm, kNaN, 5.9e-5, "mm");
  Print("fit.head_1e6_adaptive_largest", many.largest_mm, kNaN, 8.3e-4, "mm");
  Print("fit.head_1e6_adaptive_vertices", many.vertices, kNaN, 2 * 1077, "1");
  Print("fit.head_1e6_adaptive_peak_mb", many.peak_mb, kNaN, 220, "MB");
  Print("fit.head_1e5_seconds", some.seconds, kNaN, kNaN, "s");
  Print("fit.head_1e5_rms", some.rms_mm, kNaN, 7.4e-5, "mm");
  Print("fit.head_1e5_vertices", some.vertices, kNaN, 2 * 1046, "1");
  Print("fit.head_exponent_N", std::log10(many.seconds / some.seconds), kNaN, 1.1, "1");
  Print("fit.head_1e4_seconds", few.seconds, kNaN, kNaN, "s");
  // The same fits as ceres::Problems, beside `fastest` as the peer, and the same errors.
  Print("fit.head_1e4_ceres_seconds", few_by_ceres.seconds, few.seconds, kNaN, "s");
  Print("fit.head_1e5_ceres_seconds", some_by_ceres.seconds, some.seconds, kNaN, "s");
  Print("fit.head_1e5_ceres_rms", some_by_ceres.rms_mm, kNaN, 7.4e-5, "mm");
}

}  // namespace semblance::bench
