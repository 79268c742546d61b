// SPDX-License-Identifier: GPL-3.0-or-later
// Whether the intervals of an adaptive fit hold what they should.
#include <cmath>

#include "tests/bench/fit_parts.h"
#include "tests/testing/adaptive_coverage.h"

namespace semblance::bench {
using namespace problems;

// How far the share is from the 90 % that it should be; with a tolerance of several times the noise
// it is known to be less.
void RunCoverage() {
  constexpr int kDraws = 40;
  const double fine = testing::AdaptiveCoverage(1, kDraws);
  Print("fit.adaptive_coverage_90", fine, kNaN, kNaN, "share");
  Print("fit.adaptive_coverage_90_off", std::abs(fine - 0.9), kNaN, 0.02, "share");
  Print("fit.adaptive_coverage_90_at_5_noise", testing::AdaptiveCoverage(5, kDraws), kNaN, kNaN,
        "share");
}

}  // namespace semblance::bench
