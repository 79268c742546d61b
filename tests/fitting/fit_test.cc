// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/fit.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "fitting/plan/fit_driver.h"
#include "fitting/problem/placement.h"
#include "fitting/terms/term_cost.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/splines.h"

namespace semblance::fitting {
namespace {

using ::testing::HasSubstr;
using testing::LargestDistance;
using testing::LargestMove;
using testing::RandomSurface;
using testing::SameBytes;
using testing::SmoothSurface;

const std::vector<Term> kPointsOnly = {PointTerm{}};

HSplineShape Shape(Closure closure = Closure::kOpen) {
  return {.patches_u = 4, .patches_v = 3, .max_level = 3, .closure = closure};
}

// Points of `surface` at random (u,v), moved by `shift` and a random vector of at most noise_mm.
FitTarget TargetOn(const HSplineSurface& surface, int count, const Vec3& shift = Vec3::Zero(),
                   double noise_mm = 0) {
  Random random(77);
  FitTarget target;
  for (int k = 0; k < count; ++k) {
    const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
    target.points.push_back(
        {.label = fmt::format("p{}", k),
         .position = surface.Point(uv) + shift + random.InBox(-noise_mm, noise_mm),
         .uv = uv,
         .weight = random.Uniform(0.5, 2)});
  }
  return target;
}

std::map<VertexId, Vec3> OffsetsOf(const HSplineSurface& surface, int level) {
  std::map<VertexId, Vec3> offsets;
  for (const auto& [vertex, offset] : surface.Offsets()) {
    if (vertex.level == level) {
      offsets.emplace(vertex, offset);
    }
  }
  return offsets;
}

TEST(Fit, ReproducesASurfaceOfTheSpace) {
  for (const Closure closure : {Closure::kOpen, Closure::kPeriodicU}) {
    HSplineShape shape = Shape(closure);
    shape.max_level = 1;
    const HSplineSurface truth = RandomSurface(shape, 1), start = SmoothSurface(shape, 2);
    const FitResult result =
        Fit(start, TargetOn(truth, 3000), {},
            {.plan = ListedPlan{.schedule = {{1, 1}}}, .terms = kPointsOnly}, {});
    EXPECT_LT(LargestMove(result.surface.Net(1), truth.Net(1)), 1e-8);
    EXPECT_LT(LargestDistance(result.surface, truth, {}), 1e-9);
    EXPECT_LT(result.point_rms_mm, 1e-9);
    EXPECT_TRUE(result.usable);
  }
}

// The rows state the whole surface, so the detail of finer levels is taken off them.
TEST(Fit, RowsOfTheCallerMoveACoarseLevelUnderItsDetail) {
  const HSplineSurface start = RandomSurface(Shape(), 1);
  const Vec3 shift(3, -2, 5);
  RowsTerm rows;
  Random random(5);
  for (int k = 0; k < 400; ++k) {
    const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
    const Vec3 there = start.Point(uv) + shift;
    rows.rows.push_back(
        {.at = {{uv.x(), uv.y(), 0, 0, 1}}, .equals = {there.x(), there.y(), there.z()}});
  }
  FitTarget target = TargetOn(start, 3);
  const FitResult result =
      Fit(start, target, {}, {.plan = ListedPlan{.schedule = {{0, 1}}}, .terms = {rows}}, {});
  for (double u = 0.05; u < 1; u += 0.1) {
    EXPECT_LT((result.surface.Point({u, 0.4}) - start.Point({u, 0.4}) - shift).norm(), 1e-8);
  }
}

TEST(Fit, TakesTheFractionOfTheWay) {
  const HSplineSurface truth = RandomSurface(Shape(), 1), start = RandomSurface(Shape(), 2);
  const FitTarget target = TargetOn(truth, 200);
  for (const int level : {0, 1, 2}) {
    const ControlNet whole =
        Fit(start, target, {}, {.plan = ListedPlan{.schedule = {{level, 1}}}}, {})
            .surface.Net(level);
    for (const double f : {0.0, 0.3, 0.4}) {
      const ControlNet part =
          Fit(start, target, {}, {.plan = ListedPlan{.schedule = {{level, f}}}}, {})
              .surface.Net(level);
      const ControlNet& c = start.Net(level);
      for (std::size_t k = 0; k < c.vertices.size(); ++k) {
        const Vec3 expected = c.vertices[k] + f * (whole.vertices[k] - c.vertices[k]);
        ASSERT_LT((part.vertices[k] - expected).norm(), 1e-10);
      }
    }
  }
}

TEST(Fit, ChangesTheLevelsOfTheScheduleAndNoOther) {
  const HSplineSurface truth = RandomSurface(Shape(), 1), start = RandomSurface(Shape(), 2);
  const FitTarget target = TargetOn(truth, 200);
  for (const std::vector<int>& levels : {std::vector<int>{0}, {1}, {2}, {0, 2}, {3, 1}}) {
    ListedPlan plan{.schedule = {}};
    for (const int level : levels) {
      plan.schedule.push_back({level, 0.5});
    }
    const HSplineSurface fitted = Fit(start, target, {}, {.plan = plan}, {}).surface;
    const auto scheduled = [&](int level) {
      return std::find(levels.begin(), levels.end(), level) != levels.end();
    };
    EXPECT_EQ(SameBytes(fitted.Net(0), start.Net(0)), !scheduled(0));
    for (const int level : {1, 2, 3}) {
      EXPECT_EQ(OffsetsOf(fitted, level) == OffsetsOf(start, level), !scheduled(level)) << level;
    }
  }
}

// The schedule of thesis 4.4: each step goes its fraction of the way of the level's solve, from the
// surface that the previous steps have left.
TEST(Fit, TheScheduleByDefaultIsThePublishedOne) {
  const std::vector<ScheduleStep> published = {{0, 0.4},  {1, 0.35}, {2, 0.35},
                                               {0, 0.35}, {1, 0.3},  {2, 0.3}};
  const HSplineSurface start = RandomSurface(Shape(), 2);
  const FitTarget target = TargetOn(RandomSurface(Shape(), 1), 200);
  const FitResult result = Fit(start, target, {}, {}, {});
  ASSERT_EQ(result.levels.size(), published.size());
  HSplineSurface by_hand = start;
  for (std::size_t k = 0; k < published.size(); ++k) {
    const auto [level, fraction] = published[k];
    const ListedPlan whole{.schedule = {{level, 1}}};
    const ControlNet solved =
        Fit(by_hand, start, target, {}, {.plan = whole}, {}).surface.Net(level);
    ControlNet net = by_hand.Net(level);
    for (std::size_t v = 0; v < net.vertices.size(); ++v) {
      net.vertices[v] += fraction * (solved.vertices[v] - net.vertices[v]);
    }
    by_hand.SetNet(level, net);
    EXPECT_EQ(result.levels[k].level, level);
    EXPECT_EQ(result.levels[k].fraction, fraction);
    EXPECT_NEAR(result.levels[k].rms_after_mm, PointRms(by_hand, target, 1), 1e-9);
  }
  EXPECT_LT(LargestDistance(result.surface, by_hand, {}), 1e-9);
  EXPECT_GT(LargestDistance(result.surface, start, {}), 1);
}

TEST(Fit, ThePublishedScheduleNeverTouchesLevelThree) {
  const HSplineSurface start = RandomSurface(Shape(), 2);
  const FitResult result = Fit(start, TargetOn(RandomSurface(Shape(), 1), 200), {}, {}, {});
  ASSERT_EQ(result.levels.size(), 6u);
  EXPECT_EQ(OffsetsOf(result.surface, 3), OffsetsOf(start, 3));
  EXPECT_FALSE(OffsetsOf(start, 3).empty());
}

TEST(Fit, EveryStepComesNearer) {
  const HSplineSurface truth = RandomSurface(Shape(), 1), start = RandomSurface(Shape(), 2);
  const FitResult result = Fit(start, TargetOn(truth, 400, Vec3(3, -8, 2), 0.3), {}, {}, {});
  for (const LevelSummary& step : result.levels) {
    EXPECT_LT(step.rms_after_mm, step.rms_before_mm) << step.level;
    EXPECT_TRUE(step.usable) << step.termination;
    EXPECT_GT(step.max_move_mm, 0);
    EXPECT_GT(step.iterations, 0);
  }
  EXPECT_DOUBLE_EQ(result.levels.back().rms_after_mm, result.point_rms_mm);
}

// The default terms allow both solvers, which minimise the same sum.
TEST(Fit, TheSolverIsTheRequestedOneAndDoesNotChangeTheSurface) {
  const HSplineSurface start = RandomSurface(Shape(), 2);
  const FitTarget target = TargetOn(RandomSurface(Shape(), 1), 400);
  const FitResult ceres = Fit(start, target, {}, {.solver = Solver::kCeres}, {});
  const FitResult direct = Fit(start, target, {}, {.solver = Solver::kFastest}, {});
  for (std::size_t k = 0; k < ceres.levels.size(); ++k) {
    EXPECT_EQ(ceres.levels[k].solver, "ceres");
    EXPECT_EQ(direct.levels[k].solver, "direct");
  }
  for (const FitPoint& p : target.points) {
    EXPECT_LT((ceres.surface.Point(p.uv) - direct.surface.Point(p.uv)).norm(), 1e-6);
  }
}

// A template that meets its target does not move, whatever detail its finer levels have.
TEST(Fit, ATemplateThatFitsStays) {
  const HSplineSurface start = RandomSurface(Shape(), 3, 60);
  const FitTarget target = TargetOn(start, 300);
  EXPECT_LT(LargestDistance(Fit(start, target, {}, {}, {}).surface, start, {}), 1e-8);
  const FitOptions level{.plan = ListedPlan{.aim = FitAim::kLevel}};
  EXPECT_GT(LargestDistance(Fit(start, target, {}, level, {}).surface, start, {}), 1e-2);
}

TEST(Fit, IsEquivariantUnderRigidMotion) {
  const Similarity pose = {.scale = 1,
                           .rotation = Eigen::AngleAxisd(1.1, Vec3(1, 2, -1).normalized()).matrix(),
                           .translation = Vec3(30, -60, 9)};
  const HSplineSurface truth = RandomSurface(Shape(), 1), start = RandomSurface(Shape(), 2);
  const FitTarget target = TargetOn(truth, 150, Vec3(2, 4, 6));
  FitTarget moved = target;
  for (FitPoint& p : moved.points) {
    p.position = pose * p.position;
  }
  const HSplineSurface a = Fit(start, target, {}, {}, {}).surface;
  const HSplineSurface b = Fit(Transformed(start, pose), moved, {}, {}, {}).surface;
  EXPECT_LT(LargestDistance(b, a, pose), 1e-7);
}

TEST(Fit, FeaturesGetTheirOffsetsBack) {
  const HSplineSurface start = RandomSurface(Shape(), 2);
  const FitTarget target = TargetOn(RandomSurface(Shape(), 1), 300);
  std::vector<VertexId> features;
  for (const auto& [vertex, offset] : start.Offsets()) {
    features.push_back(vertex);
  }
  features.push_back({2, 7, 9});  // has no offset in the template, and none afterwards
  ASSERT_FALSE(start.Offset({2, 7, 9}).has_value());
  const FitResult restored = Fit(start, target, features, {}, {});
  EXPECT_EQ(restored.restored_features, static_cast<int>(features.size()));
  int changed = 0;
  const FitResult left = Fit(start, target, features, {.features = FreeFeatures{}}, {});
  for (const VertexId& feature : features) {
    EXPECT_EQ(restored.surface.Offset(feature), start.Offset(feature));
    changed += left.surface.Offset(feature) == start.Offset(feature) ? 0 : 1;
  }
  EXPECT_GT(changed, 10);
  EXPECT_EQ(left.restored_features, 0);
}

TEST(Fit, FrozenFeaturesKeepTheirOffsetsAndWeightedOnesResist) {
  const HSplineSurface start = RandomSurface(Shape(), 2);
  const FitTarget target = TargetOn(RandomSurface(Shape(), 1), 300);
  std::vector<VertexId> features = {{2, 7, 9}};  // without an offset
  for (const auto& [vertex, offset] : start.Offsets()) {
    features.push_back(vertex);
  }
  const auto moved = [&](const FeatureRule& rule) {
    const FitResult result = Fit(start, target, features, {.features = rule}, {});
    double sum = 0;
    for (const VertexId& feature : features) {
      sum += (result.surface.Offset(feature).value_or(Vec3::Zero()) -
              start.Offset(feature).value_or(Vec3::Zero()))
                 .norm();
    }
    return sum;
  };
  const FitResult frozen = Fit(start, target, features, {.features = FrozenFeatures{}}, {});
  for (const VertexId& feature : features) {
    EXPECT_EQ(frozen.surface.Offset(feature), start.Offset(feature));
  }
  EXPECT_EQ(frozen.restored_features, static_cast<int>(features.size()));
  const double free = moved(FreeFeatures{}), some = moved(WeightedFeatures{.weight = 1}),
               few = moved(WeightedFeatures{.weight = 100});
  EXPECT_EQ(moved(WeightedFeatures{.weight = 0}), free);
  EXPECT_LT(some, 0.9 * free);
  EXPECT_LT(few, 0.5 * some);
  // Neighbours compensate for frozen features, but not for features that are restored afterwards.
  const FitResult restored = Fit(start, target, features, {}, {});
  EXPECT_LT(frozen.point_rms_mm, restored.point_rms_mm);
}

TEST(Fit, OrderOfPointsChangesNoByte) {
  const HSplineSurface start = RandomSurface(Shape(), 2);
  FitTarget target = TargetOn(RandomSurface(Shape(), 1), 300);
  const FitResult a = Fit(start, target, {}, {}, {});
  std::reverse(target.points.begin(), target.points.end());
  const FitResult b = Fit(start, target, {}, {}, {});
  EXPECT_TRUE(SameBytes(a.surface.Net(3), b.surface.Net(3)));
  EXPECT_EQ(a.surface.Offsets(), b.surface.Offsets());
  EXPECT_EQ(a.point_rms_mm, b.point_rms_mm);
  EXPECT_EQ(a.residual_mm.front(), b.residual_mm.back());
}

// A template that starts 150 mm away arrives with its shape, although there are few points.
TEST(Fit, AFarTemplateStaysInShape) {
  const HSplineSurface start = RandomSurface(Shape(), 2);
  const Vec3 shift(-120, 90, 0);
  const FitResult result = Fit(start, TargetOn(start, 40, shift), {}, {}, {});
  const double left = 0.6 * 0.65 * 0.65 * 0.65 * 0.7 * 0.7;
  const Similarity expected{.translation = (1 - left) * shift};
  EXPECT_LT(LargestDistance(result.surface, start, expected), 1e-4);
  EXPECT_NEAR(result.point_rms_mm, left * shift.norm(), 1e-4);
}

TEST(Fit, AScheduleCanBeFittedInParts) {
  const HSplineSurface start = RandomSurface(Shape(), 2);
  const FitTarget target = TargetOn(RandomSurface(Shape(), 1), 200);
  const HSplineSurface whole = Fit(start, target, {}, {}, {}).surface;
  const std::vector<ScheduleStep> published = PublishedSchedule();
  HSplineSurface parts = start;
  for (const ScheduleStep& step : published) {
    parts = Fit(parts, start, target, {}, {.plan = ListedPlan{.schedule = {step}}}, {}).surface;
  }
  EXPECT_TRUE(SameBytes(parts.Net(3), whole.Net(3)));
}

TEST(Fit, CoarseToFineIsThatList) {
  const HSplineSurface start = RandomSurface(Shape(), 2);
  const FitTarget target = TargetOn(RandomSurface(Shape(), 1), 200);
  const FitOptions plan{.plan = CoarseToFinePlan{.finest = 2, .fraction = 0.7, .sweeps = 1}};
  const FitOptions list{
      .plan = ListedPlan{.schedule = {{0, 0.7}, {1, 0.7}, {2, 0.7}, {0, 1}, {1, 1}, {2, 1}}}};
  const FitResult a = Fit(start, target, {}, plan, {}), b = Fit(start, target, {}, list, {});
  EXPECT_TRUE(SameBytes(a.surface.Net(3), b.surface.Net(3)));
  EXPECT_EQ(a.levels.size(), 6u);
  const FitOptions deep{.plan = CoarseToFinePlan{.finest = 4}};
  EXPECT_THROW(Fit(start, target, {}, deep, {}), InputError);
}

TEST(Fit, UntilRepeatsWhileItHelps) {
  const HSplineSurface start = RandomSurface(Shape(), 2);
  const FitTarget target = TargetOn(RandomSurface(Shape(), 1), 400, Vec3(3, -8, 2), 0.3);
  const double once = Fit(start, target, {}, {}, {}).point_rms_mm;
  const auto run = [&](double tolerance_mm, int max_passes) {
    const UntilPlan plan{.tolerance_mm = tolerance_mm, .max_passes = max_passes};
    return Fit(start, target, {}, {.plan = plan}, {});
  };
  const FitResult result = run(1e-3, 100);
  const std::size_t passes = result.levels.size() / 6;
  ASSERT_GT(passes, 2u);
  ASSERT_LT(passes, 100u);
  for (std::size_t pass = 0; pass < passes; ++pass) {
    const double fall =
        result.levels[6 * pass].rms_before_mm - result.levels[6 * pass + 5].rms_after_mm;
    EXPECT_EQ(fall > 1e-3, pass + 1 < passes) << pass;
  }
  EXPECT_LT(result.point_rms_mm, once);
  EXPECT_EQ(run(1e-3, 2).levels.size(), 12u);
  EXPECT_EQ(run(10, 100).levels.size(), 6u);
}

TEST(Fit, BackFittingSweepsComeNearer) {
  const HSplineSurface start = RandomSurface(Shape(), 2);
  const FitTarget target = TargetOn(RandomSurface(Shape(), 1), 400, Vec3(3, -8, 2));
  const FitOptions without{.plan = CoarseToFinePlan{}};
  const FitOptions with{.plan = CoarseToFinePlan{.sweeps = 2}};
  EXPECT_LT(Fit(start, target, {}, with, {}).point_rms_mm,
            Fit(start, target, {}, without, {}).point_rms_mm);
}

// The same displacement costs the same at every level and for every domain.
TEST(Fit, SmoothnessMeansTheSameAtEveryLevel) {
  for (const Closure closure : {Closure::kOpen, Closure::kPeriodicU}) {
    const HSplineSurface rest = SmoothSurface(Shape(closure), 2),
                         moved = SmoothSurface(Shape(closure), 3);
    const auto costs = [&](int level) {
      LevelView view{.grid = PatchGrid::Of(rest.shape(), level),
                     .start = moved.Net(level),
                     .rest = rest.Net(level),
                     .lengths_mm = Vec2(130, 80),
                     .observations = {}};
      return std::array{
          TermCost(SmoothnessTerm{}, view, view.start), TermCost(MembraneTerm{}, view, view.start),
          MeanLengths(view.grid, view.start).x(), MeanLengths(view.grid, view.start).y()};
    };
    const auto coarse = costs(0), fine = costs(3);
    for (std::size_t k = 0; k < coarse.size(); ++k) {
      EXPECT_NEAR(fine[k], coarse[k], 1e-9 * coarse[k]);
    }
  }
}

TEST(Fit, DowelsAndSeedsAreReportedApart) {
  const HSplineSurface start = SmoothSurface(Shape(), 2);
  FitTarget target = TargetOn(start, 20, Vec3(0, 0, 3));
  target.points[4].role = PointRole::kSeed;
  target.points[4].position += Vec3(0, 0, 50);
  const FitResult result = Fit(start, target, {}, {.plan = ListedPlan{.schedule = {{0, 0}}}}, {});
  EXPECT_NEAR(result.dowel_rms_mm, 3, 1e-12);
  EXPECT_GT(result.point_rms_mm, 5);
  EXPECT_NEAR(result.residual_mm[4], 53, 1e-9);
}

TEST(Fit, WrongInputIsNamed) {
  const HSplineSurface start = SmoothSurface(Shape(), 2);
  const FitTarget target = TargetOn(start, 20);
  const auto message = [&](const FitTarget& t, const FitOptions& o,
                           const std::vector<VertexId>& features) -> std::string {
    try {
      Fit(start, t, features, o, {});
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_THAT(
      message(target, {.plan = ListedPlan{.schedule = {{0, 1}, {4, 1}}}}, {}),
      HasSubstr("fit: plan.schedule[1].level: level 4 is finer than the surface, whose finest "
                "level is 3"));
  EXPECT_THAT(message(target, {.plan = ListedPlan{.schedule = {{0, 1.5}}}}, {}),
              HasSubstr("fraction 1.5"));
  EXPECT_THAT(message(target, {.plan = ListedPlan{.schedule = {}}}, {}),
              HasSubstr("plan.schedule: it is empty"));
  EXPECT_THAT(message({}, {}, {}), HasSubstr("no point"));
  EXPECT_THAT(message(target, {}, {{0, 1, 1}}), HasSubstr("feature vertex (1, 1) is of level 0"));
  EXPECT_THAT(message(target, {}, {{1, 999, 1}}), HasSubstr("999"));
  HSplineShape other = Shape();
  other.patches_u = 6;
  EXPECT_THROW(Fit(start, SmoothSurface(other, 1), target, {}, {}, {}), InputError);
}

TEST(Fit, StopsWhenAsked) {
  const HSplineSurface start = SmoothSurface(Shape(), 2);
  std::stop_source stop;
  RunContext context;
  context.stop_token = stop.get_token();
  int events = 0;
  context.on_event = [&](const Event& e) {
    EXPECT_EQ(e.step, "fit");
    if (++events == 2) {
      stop.request_stop();
    }
  };
  EXPECT_THROW(Fit(start, TargetOn(start, 20), {}, {}, context), Cancelled);
  EXPECT_EQ(events, 2);
}

}  // namespace
}  // namespace semblance::fitting
