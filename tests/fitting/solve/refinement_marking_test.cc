// SPDX-License-Identifier: GPL-3.0-or-later
// Tolerances of parts of the domain.
#include "fitting/solve/refinement_marking.h"

#include <gtest/gtest.h>

#include <vector>

#include "fitting/fit.h"
#include "tests/testing/scattered_data.h"

namespace semblance {
namespace {

const HSplineShape kShape = {.patches_u = 8, .patches_v = 8, .max_level = 4};

FitResult FitBy(const AdaptivePlan& plan) {
  const FitTarget target = testing::Scattered(testing::FrankePoint, 30000, 1e-4, 7);
  return Fit(testing::PlainStart(kShape), target, {},
             {.plan = plan, .terms = {PointTerm{}}, .solver = Solver::kFastest}, {});
}

AdaptivePlan Loose(std::vector<ToleranceRegion> regions) {
  return {.tolerance_mm = 0.1, .regions = std::move(regions), .finest = 4};
}

// Level 0 is within the plan's tolerance everywhere: what is finer is there for the region.
TEST(Regions, PointsAreWithinTheToleranceOfTheirRegion) {
  const ToleranceRegion region{.u = {0.6, 0.9}, .v = {0.2, 0.45}, .tolerance_mm = 1e-3};
  ASSERT_TRUE(FitBy(Loose({})).surface.Offsets().empty());
  const FitResult fit = FitBy(Loose({region}));
  int inside = 0;
  for (std::size_t k = 0; k < fit.uv.size(); ++k) {
    if (region.Holds(fit.uv[k].x(), fit.uv[k].y())) {
      EXPECT_LE(fit.residual_mm[k], 1e-3);
      ++inside;
    }
  }
  EXPECT_GT(inside, 1000);
  EXPECT_FALSE(fit.surface.Offsets().empty());
  for (const auto& [vertex, offset] : fit.surface.Offsets()) {
    const Vec2 uv = fit.surface.ParameterOf(vertex);
    EXPECT_TRUE(ToleranceRegion({.u = {0.6 - 0.26, 0.9 + 0.26}, .v = {0.2 - 0.26, 0.45 + 0.26}})
                    .Holds(uv.x(), uv.y()))
        << uv.transpose();
  }
}

TEST(Regions, OneOfAllTheDomainIsThePlansOwnTolerance) {
  const FitResult whole = FitBy(Loose({{.tolerance_mm = 2e-3}}));
  const FitResult plain = FitBy({.tolerance_mm = 2e-3, .finest = 4});
  EXPECT_FALSE(plain.surface.Offsets().empty());
  EXPECT_EQ(whole.surface.Offsets(), plain.surface.Offsets());
  EXPECT_EQ(whole.residual_mm, plain.residual_mm);
}

TEST(Regions, OfSeveralTheLastCounts) {
  const ToleranceRegion fine{.u = {0, 0.5}, .tolerance_mm = 1e-3};
  const FitResult again = FitBy(Loose({fine, {.tolerance_mm = 0.1}}));
  EXPECT_TRUE(again.surface.Offsets().empty());
}

}  // namespace
}  // namespace semblance
