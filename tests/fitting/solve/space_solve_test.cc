// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "fitting/fit.h"
#include "fitting/plan/fit_driver.h"
#include "fitting/problem/placement.h"
#include "fitting/problem/start_surface.h"
#include "fitting/solve/space_solve.h"
#include "fitting/solve/space_system.h"
#include "fitting/terms/term_cost.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/level_views.h"
#include "tests/testing/scattered_data.h"
#include "tests/testing/splines.h"

namespace semblance::fitting {
namespace {

using testing::CleanError;
using testing::ErrorAgainst;
using testing::FrankePoint;
using ::testing::HasSubstr;
using testing::HeadPoint;
using testing::LargestDistance;
using testing::LargestMove;
using testing::PlainStart;
using testing::RandomSurface;
using testing::Scattered;
using testing::SmoothSurface;

FitOptions Adaptive(double tolerance_mm, int finest, std::vector<Term> terms = {PointTerm{}}) {
  return {.plan = AdaptivePlan{.tolerance_mm = tolerance_mm, .finest = finest},
          .terms = std::move(terms),
          .solver = Solver::kFastest};
}

RunContext Threads(int count) {
  RunContext context;
  context.threads = count;
  return context;
}

int VerticesOf(const HSplineSurface& surface) {
  return surface.Columns(0) * surface.Rows(0) + static_cast<int>(surface.Offsets().size());
}

HSplineShape HeadShape(int finest = 4) {
  return {.patches_u = 8, .patches_v = 8, .max_level = finest, .closure = Closure::kPeriodicU};
}

FitTarget PointsOf(const HSplineSurface& surface, int count) {
  return Scattered([&](const Vec2& uv) { return surface.Point(uv); }, count, 0, 5);
}

TEST(AdaptiveFit, ReproducesASurfaceWhoseVerticesAreKnown) {
  for (const Closure closure : {Closure::kOpen, Closure::kPeriodicU}) {
    const HSplineShape shape{.patches_u = 4, .patches_v = 3, .max_level = 3, .closure = closure};
    const HSplineSurface truth = RandomSurface(shape, 1);
    HSplineSurface start = truth;  // the same vertices, elsewhere
    std::map<VertexId, std::optional<Vec3>> offsets;
    for (const auto& [vertex, offset] : truth.Offsets()) {
      offsets[vertex] = 0.3 * offset + Vec3(0.1, -0.2, 0.4);
    }
    start.SetOffsets(offsets);
    const FitResult result = Fit(start, PointsOf(truth, 40000), {}, Adaptive(1, 3), {});
    EXPECT_LT(LargestDistance(result.surface, truth), 1e-9);
    EXPECT_LT(result.point_rms_mm, 1e-9);
    const LevelSummary& last = result.levels.back();
    EXPECT_EQ(last.rank, last.free_vertices);  // the points determine every vertex
    EXPECT_EQ(last.uncovered_vertices, 0);
    EXPECT_GE(last.coverage.patches, 12);
    EXPECT_EQ(last.coverage.empty_patches, 0);
    EXPECT_EQ(result.surface.Offsets().size(), truth.Offsets().size());
    EXPECT_TRUE(result.usable);
  }
}

// Shifting all points of a tube by some patches shifts the surface, and puts finer vertices across
// u = 0.
TEST(AdaptiveFit, ATubeHasNoSeam) {
  const HSplineShape shape{
      .patches_u = 8, .patches_v = 8, .max_level = 3, .closure = Closure::kPeriodicU};
  const FitTarget target = Scattered(testing::HeadPoint, 20000, 1e-4, 5);
  const FitOptions options =
      Adaptive(8e-4, 3, {PointTerm{}, SmoothnessTerm{.weight = 1e-9, .length_mm = 1}});
  const FitResult here = Fit(testing::PlainStart(shape), target, {}, options, {});
  EXPECT_GT(here.surface.Offsets(2).size(), 20u);
  for (const int patches : {3, 5}) {
    const Vec2 shift(patches / 8.0, 0);
    FitTarget shifted = target;
    for (FitPoint& p : shifted.points) {
      p.uv.x() = IntoUnit(p.uv.x() + shift.x(), true);
    }
    ControlNet net = testing::PlainStart(shape).Net(0);
    const ControlNet kept = net;
    for (int j = 0; j < net.rows; ++j) {
      for (int i = 0; i < net.columns; ++i) {
        net.At((i + patches) % 8, j) = kept.At(i, j);
      }
    }
    const FitResult there = Fit(HSplineSurface(shape, net), shifted, {}, options, {});
    EXPECT_EQ(there.surface.Offsets().size(), here.surface.Offsets().size());
    EXPECT_NEAR(there.point_rms_mm, here.point_rms_mm, 1e-9);
    EXPECT_LT(testing::ErrorAgainst(
                  [&](const Vec2& uv) -> Vec3 { return here.surface.Point(uv - shift); },
                  there.surface, 80)
                  .largest,
              1e-8);
  }
}

// Patch k of twelve has k points.
TEST(AdaptiveFit, CoverageCountsThePointsOfEachPatch) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 3, .max_level = 0};
  const HSplineSurface start = SmoothSurface(shape, 2);
  Random random(1);
  FitTarget target;
  for (int patch = 0; patch < 12; ++patch) {
    for (int k = 0; k < patch; ++k) {
      const Vec2 uv((patch % 4 + random.Uniform(0.01, 0.99)) / 4,
                    (patch / 4 + random.Uniform(0.01, 0.99)) / 3);
      target.points.push_back({.label = {}, .position = start.Point(uv), .uv = uv});
    }
  }
  const PatchCoverage coverage =
      Fit(start, target, {}, Adaptive(1, 0, {PointTerm{}, MembraneTerm{}}), {})
          .levels.back()
          .coverage;
  EXPECT_EQ(coverage.patches, 12);
  EXPECT_EQ(coverage.empty_patches, 1);
  EXPECT_EQ(coverage.median_patch_points, 6);  // of 1 .. 11
  const PatchCoverage even = MakeCoverage({0, 7, 4, 0, 1, 5});
  EXPECT_EQ(even.empty_patches, 2);
  EXPECT_EQ(even.median_patch_points, 4.5);
}

// Compares with the fit of one level as a plain B-spline.
TEST(AdaptiveFit, WithoutOverlaysItIsTheFitOfLevelZero) {
  const std::vector<Term> terms = {PointTerm{}, SmoothnessTerm{.weight = 0.05},
                                   MembraneTerm{.weight = 0.2, .of = SmoothnessOf::kSurface}};
  for (const Closure closure : {Closure::kOpen, Closure::kPeriodicU}) {
    const HSplineShape shape{.patches_u = 5, .patches_v = 4, .max_level = 0, .closure = closure};
    const HSplineSurface start = SmoothSurface(shape, 2);
    const FitTarget target = PointsOf(SmoothSurface(shape, 8), 300);
    const FitResult adaptive = Fit(start, target, {}, Adaptive(1e-9, 0, terms), {});
    const FitResult level =
        Fit(start, target, {}, {.plan = ListedPlan{.schedule = {{0, 1}}}, .terms = terms}, {});
    EXPECT_LT(LargestDistance(adaptive.surface, level.surface), 3e-7);
    for (std::size_t t = 0; t < terms.size(); ++t) {
      const double expected = level.levels[0].terms[t].after;
      EXPECT_NEAR(adaptive.levels.back().terms[t].after, expected, 1e-7 * expected);
    }
  }
}

// Compares the gradient of the assembled system with differences of the cost, for unknowns of all
// levels.
TEST(AdaptiveFit, TheSystemIsTheGradientOfTheCost) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 3, .max_level = 3};
  const HSplineSurface rest = RandomSurface(shape, 1), start = RandomSurface(shape, 1);
  const PointCloud cloud(shape,
                         Scattered([&](const Vec2& uv) { return rest.Point(uv); }, 500, 2, 6));
  HierarchicalSplineSpace space(start, rest, cloud);
  const std::vector<Term> terms = {SmoothnessTerm{.weight = 0.5},
                                   MembraneTerm{.weight = 3, .of = SmoothnessOf::kSurface}};
  const std::vector<LevelStiffness> forms = StiffnessByLevel(shape, terms, {130, 80});
  const double scale = 1 / cloud.weight_sum();
  const auto cost = [&] {
    space.Measure({}, 1, nullptr);
    return scale * space.Squares() + TotalEnergy(space, forms);
  };
  Random random(3);
  Eigen::MatrixX3d step(space.rows(), 3);
  for (Eigen::Index k = 0; k < step.size(); ++k) {
    step(k / 3, k % 3) = random.Uniform(-1, 1);
  }
  cost();
  const NormalSystem system = Assemble(space, scale, forms);
  const Eigen::MatrixXd normal = Eigen::MatrixXd(system.lower).selfadjointView<Eigen::Lower>();
  const double here = cost();
  ControlNet net = space.Values();
  for (int k = 0; k < space.rows(); ++k) {
    net.vertices[k] += step.row(k).transpose();
  }
  space.SetValues(net);
  const double there = cost();
  const double slope = -2 * step.cwiseProduct(system.right).sum();
  const double bend = step.cwiseProduct(normal * step).sum();
  EXPECT_NEAR(there, here + slope + bend, 1e-9 * there);
}

TEST(AdaptiveFit, HeadAsGoodAsTheAdaptivePeersWithAsFewVertices) {
  const FitTarget target = Scattered(HeadPoint, 100000, 1e-4, 9);
  const FitResult result = Fit(PlainStart(HeadShape()), target, {}, Adaptive(1e-3, 4), Threads(2));
  const CleanError error = ErrorAgainst(HeadPoint, result.surface, 200);
  EXPECT_LT(error.rms, 1.2e-4);
  EXPECT_LT(error.largest, 1.3e-3);
  EXPECT_LT(VerticesOf(result.surface), 2 * 1046);
}

TEST(AdaptiveFit, FrankesFunctionWithinItsNoise) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 4};
  const FitTarget target = Scattered(FrankePoint, 20000, 1e-3, 9);
  const FitResult result = Fit(PlainStart(shape), target, {}, Adaptive(6e-3, 4), {});
  EXPECT_LT(ErrorAgainst(FrankePoint, result.surface, 100).rms, 8e-4);
  EXPECT_LT(VerticesOf(result.surface), 400);
  EXPECT_NEAR(result.point_rms_mm, 1e-3 * std::sqrt(3), 2e-4);
}

// A tolerance below the noise adds many vertices, but between the points the surface stays within
// the noise.
TEST(AdaptiveFit, NoToleranceIsTooFineForTheSurfaceBetweenThePoints) {
  constexpr double kNoise = 1e-3;
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 5};
  const FitTarget target = Scattered(FrankePoint, 4000, kNoise, 5);
  for (const double noises : {8.0, 4.0, 2.0, 1.0}) {
    const FitResult fit =
        Fit(PlainStart(shape), target, {}, Adaptive(noises * kNoise, shape.max_level), {});
    const CleanError error = ErrorAgainst(FrankePoint, fit.surface, 200);
    EXPECT_LT(error.rms, 2 * kNoise) << noises;
    EXPECT_LT(error.largest, 15 * kNoise) << noises;
  }
}

TEST(AdaptiveFit, VerticesAreFinerOnlyWhereTheyAreNeeded) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 5};
  const auto bump = [](const Vec2& uv) {
    return Vec3(uv.x(), uv.y(), 0.1 * std::exp(-(uv - Vec2(0.7, 0.3)).squaredNorm() / 0.002));
  };
  FitOptions options = Adaptive(1e-3, 5);
  const FitTarget target = Scattered(bump, 20000, 0, 9);
  const FitResult tight = Fit(PlainStart(shape), target, {}, options, {});
  ASSERT_FALSE(tight.surface.Offsets(3).empty());
  for (const auto& [vertex, offset] : tight.surface.Offsets(3)) {
    EXPECT_LT((tight.surface.GrevillePoint(vertex) - Vec2(0.7, 0.3)).norm(), 0.35);
  }
  std::get<AdaptivePlan>(options.plan).margin = 2;
  const FitResult wide = Fit(PlainStart(shape), target, {}, options, {});
  EXPECT_GT(VerticesOf(wide.surface), VerticesOf(tight.surface));
  EXPECT_LE(ErrorAgainst(bump, wide.surface, 100).largest, 1.2e-3);
  for (const FitResult& result : {tight, wide}) {
    EXPECT_LT(*std::max_element(result.residual_mm.begin(), result.residual_mm.end()), 1e-3);
  }
}

TEST(AdaptiveFit, CostFallsAndMisfitFallsFromRoundToRound) {
  const FitResult result =
      Fit(PlainStart(HeadShape()), Scattered(HeadPoint, 20000, 1e-4, 9), {},
          Adaptive(1e-3, 3, {PointTerm{}, SmoothnessTerm{.weight = 1e-8, .length_mm = 1}}), {});
  ASSERT_GT(result.levels.size(), 2u);
  for (const LevelSummary& round : result.levels) {
    double before = 0, after = 0;
    for (const TermCosts& term : round.terms) {
      before += term.before;
      after += term.after;
    }
    EXPECT_LE(after, before * (1 + 1e-12));
  }
  EXPECT_LT(result.levels.back().rms_after_mm, 0.2 * result.levels.front().rms_after_mm);
}

TEST(AdaptiveFit, OrderOfPointsAndThreadsChangeNoByte) {
  FitTarget target = Scattered(HeadPoint, 20000, 1e-4, 9);
  target.points.push_back(target.points[7]);
  target.points.push_back(target.points[7]);
  target.points.back().position.x() += 1e-4;
  const FitOptions options = Adaptive(2e-3, 3);
  const FitResult a = Fit(PlainStart(HeadShape()), target, {}, options, {});
  std::reverse(target.points.begin(), target.points.end());
  FitResult b = Fit(PlainStart(HeadShape()), target, {}, options, Threads(3));
  EXPECT_EQ(a.surface.Offsets(), b.surface.Offsets());
  const ControlNet p = a.surface.Net(0), q = b.surface.Net(0);
  EXPECT_EQ(std::memcmp(p.vertices.data(), q.vertices.data(), p.vertices.size() * sizeof(Vec3)), 0);
  std::reverse(b.residual_mm.begin(), b.residual_mm.end());
  EXPECT_EQ(a.residual_mm, b.residual_mm);
  EXPECT_EQ(a.point_rms_mm, b.point_rms_mm);
}

TEST(AdaptiveFit, IsEquivariantUnderRigidMotion) {
  const Similarity pose = {.scale = 1,
                           .rotation = Eigen::AngleAxisd(1.1, Vec3(1, 2, -1).normalized()).matrix(),
                           .translation = Vec3(3, -6, 0.9)};
  const FitTarget target = Scattered(HeadPoint, 20000, 1e-4, 9);
  FitTarget moved = target;
  for (FitPoint& p : moved.points) {
    p.position = pose * p.position;
  }
  const FitOptions options =
      Adaptive(2e-3, 3, {PointTerm{}, SmoothnessTerm{.weight = 1e-8, .length_mm = 1}});
  const HSplineSurface start = PlainStart(HeadShape());
  const HSplineSurface a = Fit(start, target, {}, options, {}).surface;
  const HSplineSurface b = Fit(Transformed(start, pose), moved, {}, options, {}).surface;
  EXPECT_LT(LargestDistance(b, a, pose), 1e-9);
}

// One point in fifty has an error of 0.3. A loss ignores these points, and no vertices are added
// for them.
TEST(AdaptiveFit, OutliersDoNotBreakARobustFit) {
  FitTarget target = Scattered(HeadPoint, 20000, 1e-4, 9);
  for (std::size_t k = 0; k < target.points.size(); k += 50) {
    target.points[k].position += Vec3(0.3, 0, 0);
  }
  for (const RobustLoss loss : {RobustLoss::kCauchy, RobustLoss::kTukey}) {
    const PointTerm points{.loss = loss, .loss_width_mm = 0.05};
    const FitResult robust =
        Fit(PlainStart(HeadShape(3)), target, {}, Adaptive(8e-3, 3, {points}), {});
    EXPECT_LT(ErrorAgainst(HeadPoint, robust.surface, 100).rms, 1.5e-3) << static_cast<int>(loss);
  }
  const FitResult plain = Fit(PlainStart(HeadShape(3)), target, {}, Adaptive(8e-3, 3), {});
  EXPECT_GT(ErrorAgainst(HeadPoint, plain.surface, 100).rms, 5e-3);
}

// In a hole of 30 % of the width the surface bridges and does not oscillate.
TEST(AdaptiveFit, SmoothnessBridgesAHole) {
  const HSplineShape shape{.patches_u = 16, .patches_v = 16, .max_level = 3};
  FitTarget target = Scattered(FrankePoint, 20000, 1e-3, 9);
  std::erase_if(target.points, [](const FitPoint& p) {
    return (p.uv - Vec2(0.5, 0.5)).cwiseAbs().maxCoeff() < 0.15;
  });
  const std::vector<Term> terms = {PointTerm{}, SmoothnessTerm{.weight = 1e-7, .length_mm = 1}};
  const FitResult result = Fit(PlainStart(shape), target, {}, Adaptive(6e-3, 3, terms), {});
  EXPECT_LT(ErrorAgainst(FrankePoint, result.surface, 100).largest, 0.1);
}

TEST(AdaptiveFit, FeaturesGetTheirOffsetsBack) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 3, .max_level = 2};
  const HSplineSurface start = RandomSurface(shape, 2);
  const std::vector<VertexId> features = {start.Offsets().begin()->first};
  const FitTarget target = PointsOf(RandomSurface(shape, 1), 3000);
  const FitResult result = Fit(start, target, features, Adaptive(0.5, 2), {});
  EXPECT_EQ(result.surface.Offset(features[0]), start.Offset(features[0]));
  EXPECT_EQ(result.restored_features, 1);
  EXPECT_EQ(result.residual_mm.size(), target.points.size());
  EXPECT_NEAR(result.residual_mm[5],
              (result.surface.Point(target.points[5].uv) - target.points[5].position).norm(),
              1e-12);
}

// The points bulge on one side. Both sides of the surface share the bulge, and finer vertices
// appear in pairs.
TEST(AdaptiveFit, SymmetryMakesBothSidesAlikeOnAllLevels) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 1};
  const auto bump = [](const Vec2& uv) {
    return Vec3(uv.x(), uv.y(), 0.1 * std::exp(-(uv - Vec2(0.75, 0.5)).squaredNorm() / 0.02));
  };
  const FitTarget target = Scattered(bump, 1000, 0, 9);
  const SymmetryTerm symmetry{.weight = 100, .of = SmoothnessOf::kSurface};
  const HSplineSurface surface =
      Fit(PlainStart(shape), target, {}, Adaptive(2e-2, 1, {PointTerm{}, symmetry}), {}).surface;
  ASSERT_FALSE(surface.Offsets(1).empty());
  for (const auto& [vertex, offset] : surface.Offsets()) {
    EXPECT_TRUE(surface.Offset(MirrorVertex(shape, vertex)).has_value());
  }
  double highest = 0;
  for (int k = 0; k < 400; ++k) {
    const Vec2 uv((k % 20 + 0.5) / 20, (k / 20 + 0.5) / 20);
    const Vec3 here = surface.Point(uv), there = surface.Point({1 - uv.x(), uv.y()});
    EXPECT_LT((Vec3(1 - here.x(), here.y(), here.z()) - there).norm(), 2e-3);
    highest = std::max(highest, here.z());
  }
  EXPECT_NEAR(highest, 0.05, 0.01);  // the mean of a bulge and none
}

TEST(AdaptiveFit, FrozenFeaturesKeepTheirOffsetsAndTheOthersAdapt) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 3, .max_level = 2};
  const HSplineSurface start = RandomSurface(shape, 2);
  std::vector<VertexId> features;
  for (const auto& [vertex, offset] : start.Offsets(2)) {
    features.push_back(vertex);
  }
  ASSERT_GT(features.size(), 3u);
  const FitTarget target = PointsOf(RandomSurface(shape, 1), 3000);
  const auto fit = [&](const FeatureRule& rule, Solver solver = Solver::kFastest) {
    FitOptions options = Adaptive(100, 2);
    options.features = rule;
    options.solver = solver;
    return Fit(start, target, features, options, {});
  };
  const auto moved = [&](const FitResult& result) {
    double sum = 0;
    for (const VertexId& f : features) {
      sum += (*result.surface.Offset(f) - *start.Offset(f)).norm();
    }
    return sum;
  };
  for (const Solver solver : {Solver::kFastest, Solver::kCeres}) {
    const FitResult frozen = fit(FrozenFeatures{}, solver);
    EXPECT_EQ(moved(frozen), 0);
    EXPECT_EQ(frozen.restored_features, static_cast<int>(features.size()));
    EXPECT_LT(frozen.point_rms_mm, fit(RestoreFeatures{}, solver).point_rms_mm);
    EXPECT_NEAR(frozen.point_rms_mm, PointRms(frozen.surface, target, 1), 1e-12);
  }
  const double freely = moved(fit(FreeFeatures{}));
  EXPECT_LT(moved(fit(WeightedFeatures{.weight = 1e3})), 0.5 * freely);
  EXPECT_NEAR(moved(fit(WeightedFeatures{.weight = 1e-9})), freely, 1e-3 * freely);
}

TEST(AdaptiveFit, WrongInputIsNamed) {
  const FitTarget target = Scattered(HeadPoint, 100, 0, 9);
  const auto message = [&](const FitOptions& options) -> std::string {
    try {
      Fit(PlainStart(HeadShape()), target, {}, options, {});
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(message(Adaptive(1, 5)), HasSubstr("plan.finest: level 5 is finer than the surface"));
  EXPECT_THAT(message(Adaptive(1, 1, {PointTerm{}, LandmarkTerm{}})), HasSubstr("'landmarks'"));
  EXPECT_THAT(message(Adaptive(1, 1, {PointTerm{}, SpringTerm{}})), HasSubstr("'spring'"));
  EXPECT_THAT(message(Adaptive(1, 1, {SmoothnessTerm{}})), HasSubstr("no term 'points'"));
}

// A very strong smoothness makes the matrix nearly singular in double precision. The steps of one
// of these sheets once grew without bound, to 1e112 mm.
TEST(CoupledSolve, DivergingStepsAreRejected) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 1};
  const FitOptions options{
      .plan =
          UntilPlan{
              .schedule = {{0, 1}, {1, 0.5}}, .max_passes = 2, .sweeps = 2, .aim = FitAim::kLevel},
      .terms = {PointTerm{},
                SmoothnessTerm{.weight = 1.0, .of = SmoothnessOf::kSurface, .length_mm = 1000},
                SymmetryTerm{}},
      .solver = Solver::kFastest};
  for (int seed = 1; seed <= 8; ++seed) {
    Random random(seed);
    std::vector<Vec3> positions;
    std::vector<Vec2> uv;
    for (int k = 0; k < 11 * 11; ++k) {
      const Vec2 at(k % 11 / 10.0, k / 11 / 10.0);
      const double noise = random.Uniform(-0.02, 0.02);
      const double v = at.y() + random.Uniform(-0.02, 0.02);
      const double u = at.x() + random.Uniform(-0.02, 0.02);
      positions.emplace_back(at.x(), at.y(), std::sin(3 * at.x()) * at.y() + noise);
      uv.emplace_back(std::clamp(u, 0.0, 1.0), std::clamp(v, 0.0, 1.0));
    }
    const FitResult fit =
        Fit(StartSurface(shape, positions, uv), MakeFitTarget(positions, uv), {}, options, {});
    EXPECT_LT(fit.point_rms_mm, 0.3) << seed;
  }
}

using testing::Observe;
using testing::Sheet;
using testing::View;

// 400 points on 12 patches; one in twenty has an error of 4 mm, and one in fifty is a landmark.
LevelView ViewWithOutliers() {
  std::vector<Observation> observations = Observe(Sheet(4, 3, 1, 2), 400, 3, 0.3);
  for (std::size_t k = 0; k < observations.size(); k += 20) {
    observations[k].position += Vec3(0, 0, 4);
  }
  for (std::size_t k = 7; k < observations.size(); k += 50) {
    observations[k].landmark = true;
  }
  return View(Sheet(4, 3, 1, 1), std::move(observations));
}

std::vector<Term> RobustTerms(RobustLoss loss, double width_mm) {
  return {PointTerm{.weight = 2, .loss = loss, .loss_width_mm = width_mm},
          LandmarkTerm{.weight = 0.5}, MembraneTerm{.weight = 0.02}, PriorTerm{.weight = 1e-4}};
}

double CostOf(const LevelView& view, const std::vector<Term>& terms, const ControlNet& net) {
  double sum = 0;
  for (const Term& term : terms) {
    sum += std::visit([&](const auto& t) { return TermCost(t, view, net); }, term);
  }
  return sum;
}

class EachLoss : public ::testing::TestWithParam<std::pair<RobustLoss, double>> {};

// Compressing the points of each patch in every step gives the surface of the plain form with one
// residual per point.
TEST_P(EachLoss, CompressedEqualsThePlainForm) {
  const LevelView view = ViewWithOutliers();
  const auto [loss, width_mm] = GetParam();
  const std::vector<Term> terms = RobustTerms(loss, width_mm);
  ControlNet plain = view.start;
  ASSERT_TRUE(SolveByCeres(view, terms, plain).usable);
  for (const Solver solver : {Solver::kCeres, Solver::kFastest}) {
    const LevelSolution reduced = FitLevel(view, terms, solver);
    EXPECT_TRUE(reduced.summary.usable);
    EXPECT_EQ(reduced.summary.termination, "convergence");
    EXPECT_LT(LargestMove(reduced.net, plain), 1e-5);
    EXPECT_NEAR(CostOf(view, terms, reduced.net), CostOf(view, terms, plain),
                1e-9 * CostOf(view, terms, plain));
  }
}

// Repeats single steps with the weights of the present surface.
TEST_P(EachLoss, TheCostFallsWithEveryStep) {
  LevelView view = ViewWithOutliers();
  const auto [loss, width_mm] = GetParam();
  std::vector<Term> terms = RobustTerms(loss, width_mm);
  std::get<PriorTerm>(terms.back()).towards = PriorTowards::kTemplate;
  double cost = CostOf(view, terms, view.start);
  for (int k = 0; k < 10; ++k) {
    const NormalSystem system = LevelSolve(view, terms, Solver::kFastest).System(terms);
    const Eigen::MatrixXd step = SparseFactor(system.lower, 0).Solve(system.right);
    for (std::size_t v = 0; v < view.start.vertices.size(); ++v) {
      view.start.vertices[v] += step.row(static_cast<Eigen::Index>(v)).transpose();
    }
    const double next = CostOf(view, terms, view.start);
    EXPECT_LE(next, cost * (1 + 1e-12)) << k;
    cost = next;
  }
}

INSTANTIATE_TEST_SUITE_P(Losses, EachLoss,
                         ::testing::Values(std::pair(RobustLoss::kHuber, 0.5),
                                           std::pair(RobustLoss::kCauchy, 1.0),
                                           std::pair(RobustLoss::kTukey, 12.0)));

TEST(Reweighting, PointsWithoutPullLeaveTheSurfaceToOtherTerms) {
  LevelView view = ViewWithOutliers();
  for (Observation& o : view.observations) {
    o.position += Vec3(0, 0, 500);  // beyond Tukey's width
  }
  const std::vector<Term> terms = {PointTerm{.loss = RobustLoss::kTukey, .loss_width_mm = 1},
                                   PriorTerm{.weight = 1, .towards = PriorTowards::kTemplate}};
  const LevelSolution solution = FitLevel(view, terms, Solver::kFastest);
  EXPECT_TRUE(solution.summary.usable);
  EXPECT_LT(LargestMove(solution.net, view.rest), 1e-6);
}

}  // namespace
}  // namespace semblance::fitting
