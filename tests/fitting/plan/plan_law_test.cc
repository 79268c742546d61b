// SPDX-License-Identifier: GPL-3.0-or-later
// Laws of every term in every plan by every solver. A new term is covered without being named here.
#include <gtest/gtest.h>

#include <algorithm>

#include "fitting/fit.h"
#include "fitting/plan/fit_check.h"
#include "surfaces/base/random.h"
#include "tests/testing/level_views.h"
#include "tests/testing/splines.h"

namespace semblance::fitting {
namespace {

using testing::AllTerms;
using testing::RandomSurface;
using testing::SmoothSurface;

constexpr HSplineShape kShape{.patches_u = 4, .patches_v = 3, .max_level = 2};

// Points around a surface, with bone 4 mm below them; every tenth is a landmark. A prior predicts
// the surface 1 mm higher, with a smaller standard deviation at one end than at the other.
FitTarget Target() {
  const HSplineSurface truth = RandomSurface(kShape, 1);
  Random random(5);
  FitTarget target;
  for (int k = 0; k < 600; ++k) {
    const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
    target.points.push_back({.label = {},
                             .position = truth.Point(uv) + random.InBox(-1, 1),
                             .uv = uv,
                             .weight = random.Uniform(0.5, 2),
                             .role = k % 10 == 0 ? PointRole::kLandmark : PointRole::kScattered});
    target.anchors.push_back({target.points.back().position - Vec3(0, 0, 4), Vec3(0, 0, 1)});
    target.shape.push_back({.uv = uv,
                            .position = truth.Point(uv) + Vec3(0, 0, 1),
                            .sd_mm = 1 + uv.x(),
                            .share = random.Uniform(0.5, 2)});
  }
  return target;
}

// The adaptive plan overlays the patches that are 3 mm off, which are some of all.
const SchedulePlan kPlans[] = {ListedPlan{.schedule = {{0, 0.5}, {1, 1}}},
                               CoarseToFinePlan{.finest = 1, .sweeps = 1},
                               UntilPlan{.schedule = {{0, 0.5}, {1, 0.5}}, .max_passes = 2},
                               AdaptivePlan{.tolerance_mm = 3, .finest = 1}};

bool HasLoss(const Term& term) {
  const auto* const points = std::get_if<PointTerm>(&term);
  return points != nullptr && points->loss != RobustLoss::kNone;
}

// The term with points and a little smoothness, which determine the rest.
FitOptions Options(const SchedulePlan& plan, const Term& term, Solver solver) {
  FitOptions options{.plan = plan,
                     .terms = {SmoothnessTerm{.weight = 1e-3}, MembraneTerm{.weight = 1e-2}},
                     .solver = solver};
  if (!std::holds_alternative<PointTerm>(term)) {
    options.terms.emplace_back(PointTerm{});
  }
  options.terms.push_back(term);
  // With a loss a small difference could overlay other patches, so all patches are overlaid.
  if (auto* const adaptive = std::get_if<AdaptivePlan>(&options.plan);
      adaptive != nullptr && HasLoss(term)) {
    adaptive->tolerance_mm = 1e-9;
  }
  return options;
}

double LargestDistance(const HSplineSurface& a, const HSplineSurface& b) {
  double largest = 0;
  for (int k = 0; k <= 40 * 40; ++k) {
    const Vec2 uv(k % 41 / 40.0, k / 41 / 40.0);
    largest = std::max(largest, (a.Point(uv) - b.Point(uv)).norm());
  }
  return largest;
}

double CostAfter(const FitResult& result) {
  double cost = 0;
  for (const TermCosts& term : result.levels.back().terms) {
    cost += term.after;
  }
  return cost;
}

std::string NameOf(const SchedulePlan& plan) {
  return std::string(std::visit([](const auto& p) { return p.kName; }, plan));
}

// No solve raises the cost of its terms.
void ExpectNoneDearer(const FitResult& result) {
  ASSERT_FALSE(result.levels.empty());
  for (const LevelSummary& level : result.levels) {
    double before = 0, after = 0;
    for (const TermCosts& costs : level.terms) {
      before += costs.before;
      after += costs.after;
    }
    EXPECT_LE(after, before * (1 + 1e-9));
  }
}

TEST(PlanLaws, BothSolversFindTheSameSurfaceAndNoneMakesTheTermsDearer) {
  const HSplineSurface start = SmoothSurface(kShape, 2);
  const FitTarget target = Target();
  for (const SchedulePlan& plan : kPlans) {
    for (const Term& term : AllTerms()) {
      SCOPED_TRACE(NameOf(plan) + ", " + std::string(TermName(term)));
      const FitOptions options = Options(plan, term, Solver::kCeres);
      ASSERT_TRUE(FindFitFaults(options, kShape.max_level).empty());
      const FitResult ceres = Fit(start, target, {}, options, {}),
                      fastest = Fit(start, target, {}, Options(plan, term, Solver::kFastest), {});
      EXPECT_TRUE(ceres.usable && fastest.usable);
      ExpectNoneDearer(ceres);
      EXPECT_EQ(ceres.levels.back().solver, "ceres");
      if (std::holds_alternative<PointTerm>(term) || std::holds_alternative<SmoothnessTerm>(term)) {
        EXPECT_EQ(fastest.levels.back().solver, "direct");
      }
      EXPECT_EQ(ceres.surface.Offsets().size(), fastest.surface.Offsets().size());
      // A term towards the start of a solve depends on the solves before. Rows that contradict the
      // points leave a cost, and Ceres stops by the relative change of the cost.
      const bool is_loose =
          std::holds_alternative<PriorTerm>(term) || std::holds_alternative<RowsTerm>(term);
      const double near = is_loose ? 1e-5 : 1e-6;
      EXPECT_LT(LargestDistance(ceres.surface, fastest.surface), HasLoss(term) ? 1e-3 : near);
      EXPECT_NEAR(CostAfter(ceres), CostAfter(fastest), 1e-6 * CostAfter(fastest));
      EXPECT_GT(LargestDistance(ceres.surface, start), 0.1);
    }
  }
}

// With the finest level everywhere, all levels at once give the same cost as that level alone.
TEST(PlanLaws, TheAdaptivePlanWeighsATermAsALevelDoes) {
  HSplineShape shape = kShape;
  shape.max_level = 0;
  const HSplineSurface start = SmoothSurface(shape, 2);
  const FitTarget target = Target();
  for (const Term& term : AllTerms()) {
    SCOPED_TRACE(TermName(term));
    const FitOptions adaptive =
        Options(AdaptivePlan{.tolerance_mm = 100, .finest = 0}, term, Solver::kCeres);
    const FitOptions level = Options(ListedPlan{.schedule = {{0, 1}}}, term, Solver::kCeres);
    const FitResult a = Fit(start, target, {}, adaptive, {}), b = Fit(start, target, {}, level, {});
    // A second solve has another start and other normals, on which some terms depend.
    const bool goes_on =
        std::holds_alternative<PriorTerm>(term) || std::holds_alternative<TangentPointTerm>(term);
    EXPECT_LT(LargestDistance(a.surface, b.surface), goes_on ? 1 : HasLoss(term) ? 1e-3 : 1e-6);
    EXPECT_EQ(a.levels.front().terms.size(), b.levels.front().terms.size());
    for (std::size_t k = 0; k < b.levels[0].terms.size(); ++k) {
      const double before = b.levels[0].terms[k].before;
      EXPECT_NEAR(a.levels[0].terms[k].before, before, 1e-9 * before + 1e-12) << k;
    }
  }
}

}  // namespace
}  // namespace semblance::fitting
