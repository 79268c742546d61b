// SPDX-License-Identifier: GPL-3.0-or-later
// Tolerance regions, and refinement around gaps: where there are no points, smoothness bridges and
// stays bounded.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "fitting/fit.h"
#include "fitting/solve/refinement_marking.h"
#include "tests/testing/drawn_part.h"
#include "tests/testing/scattered_data.h"

namespace semblance::fitting {
namespace {

const HSplineShape kMarkedShape = {.patches_u = 8, .patches_v = 8, .max_level = 4};

FitResult FitBy(const AdaptivePlan& plan) {
  const FitTarget target = testing::Scattered(testing::FrankePoint, 30000, 1e-4, 7);
  return Fit(testing::PlainStart(kMarkedShape), target, {},
             {.plan = plan, .terms = {PointTerm{}}, .solver = Solver::kFastest}, {});
}

AdaptivePlan Loose(std::vector<ToleranceRegion> regions) {
  return {.tolerance_mm = 0.1, .regions = std::move(regions), .finest = 4};
}

// Level 0 meets the plan's tolerance everywhere, so all finer vertices are due to the region.
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
    const Vec2 uv = fit.surface.GrevillePoint(vertex);
    EXPECT_TRUE(ToleranceRegion({.u = {0.6 - 0.26, 0.9 + 0.26}, .v = {0.2 - 0.26, 0.45 + 0.26}})
                    .Holds(uv.x(), uv.y()))
        << uv.transpose();
  }
}

TEST(Regions, ARegionOfTheWholeDomainEqualsThePlansTolerance) {
  const FitResult whole = FitBy(Loose({{.tolerance_mm = 2e-3}}));
  const FitResult plain = FitBy({.tolerance_mm = 2e-3, .finest = 4});
  EXPECT_FALSE(plain.surface.Offsets().empty());
  EXPECT_EQ(whole.surface.Offsets(), plain.surface.Offsets());
  EXPECT_EQ(whole.residual_mm, plain.residual_mm);
}

TEST(Regions, TheLastOfSeveralRegionsApplies) {
  const ToleranceRegion fine{.u = {0, 0.5}, .tolerance_mm = 1e-3};
  const FitResult again = FitBy(Loose({fine, {.tolerance_mm = 0.1}}));
  EXPECT_TRUE(again.surface.Offsets().empty());
}

constexpr double kShare = 0.1;  // of the range of all heights

struct Range {
  double low = kNaN, high = kNaN;
  void Add(double z) {
    low = std::fmin(low, z);
    high = std::fmax(high, z);
  }
};

template <class Wanted>
Range HeightsWhere(const FitTarget& target, const Wanted& wanted) {
  Range range;
  for (const FitPoint& p : target.points) {
    if (wanted(p.uv)) {
      range.Add(p.position.z());
    }
  }
  return range;
}

Range SurfaceWithin(const testing::DrawnGap& gap, const HSplineSurface& surface) {
  constexpr int kSide = 40;
  Range range;
  for (int k = 0; k < kSide * kSide; ++k) {
    const Vec2 off((k % kSide + 0.5) / kSide * 2 - 1, (k / kSide + 0.5) / kSide * 2 - 1);
    const Vec2 uv = gap.center + gap.radius * off;
    if (off.norm() < 1 && uv.minCoeff() >= 0 && uv.maxCoeff() <= 1) {
      range.Add(surface.Point(uv).z());
    }
  }
  return range;
}

// The largest distance by which the surface in a gap leaves the range of heights of the points
// around it, relative to the range of all heights.
double MostBeyond(const FitTarget& target, const HSplineSurface& surface) {
  const Range all = HeightsWhere(target, [](const Vec2&) { return true; });
  double most = 0;
  for (const testing::DrawnGap& gap : testing::kDrawnGaps) {
    const Range near = HeightsWhere(
        target, [&](const Vec2& uv) { return (uv - gap.center).norm() < 1.5 * gap.radius; });
    const Range in = SurfaceWithin(gap, surface);
    most = std::max({most, near.low - in.low, in.high - near.high});
  }
  return most / (all.high - all.low);
}

HSplineSurface FitDrawn(const FitTarget& target, const SchedulePlan& plan, AutoOr<double> weight) {
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 3};
  const SmoothnessTerm smooth{.weight = weight, .of = SmoothnessOf::kSurface, .length_mm = 1};
  return Fit(testing::PlainStart(shape), target, {},
             {.plan = plan, .terms = {PointTerm{}, smooth}, .solver = Solver::kFastest}, {})
      .surface;
}

const ListedPlan kFinest{.schedule = {{3, 1}}};
const SchedulePlan kPlans[] = {kFinest, AdaptivePlan{.tolerance_mm = 5e-3, .finest = 3}};

TEST(Gap, TheSurfaceStaysNearTheHeightsAroundIt) {
  for (const double noise : {1e-4, 1e-3}) {
    const FitTarget target = testing::DrawnScan(12000, noise, 3);
    for (const SchedulePlan& plan : kPlans) {
      EXPECT_LT(MostBeyond(target, FitDrawn(target, plan, AutoOr<double>::Auto())), kShare)
          << noise << " plan " << plan.index();
    }
  }
}

// Shows that the test above can fail.
TEST(Gap, WithHardlyAnySmoothnessTheSurfaceDiverges) {
  const FitTarget target = testing::DrawnScan(12000, 1e-3, 3);
  EXPECT_GT(MostBeyond(target, FitDrawn(target, kFinest, 1e-18)), 3 * kShare);
}

}  // namespace
}  // namespace semblance::fitting
