// SPDX-License-Identifier: GPL-3.0-or-later
// The nested fit on known surfaces.
#include "fitting/nested/nested_fit.h"
#include "fitting/nested/nested_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fitting/fit.h"
#include "fitting/nested/neighbour_noise.h"
#include "fitting/problem/start_surface.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/scattered_data.h"
#include "tests/testing/scratch_file.h"

namespace semblance::fitting {
namespace {

using testing::ErrorAgainst;
using testing::FrankePoint;
using ::testing::HasSubstr;
using testing::HeadPoint;
using testing::Scattered;

NestedFitResult FitAuto(const FitTarget& target, Closure closure = Closure::kOpen,
                        const AutoPlan& plan = {}, const RunContext& context = {}) {
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;
  for (const FitPoint& p : target.points) {
    positions.push_back(p.position);
    uv.push_back(p.uv);
  }
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 0, .closure = closure};
  return FitNested(StartSurface(shape, positions, uv), {positions, uv}, plan, context);
}

// A height field with noise in z alone.
template <class Surface>
FitTarget Heights(const Surface& surface, int count, double noise) {
  FitTarget target = Scattered(surface, count, noise, 5);
  for (FitPoint& p : target.points) {
    p.position.head<2>() = surface(p.uv).template head<2>();
  }
  return target;
}

// Least squares on 16 x 16 patches, with which FITPACK is best here, errs by about
// noise * sqrt(361 / 20000) = 1.3e-4; MBA at its best by 3.4e-4.
TEST(NestedFit, FrankesFunctionIsFoundBelowItsNoise) {
  const NestedFitResult fit = FitAuto(Heights(FrankePoint, 20000, 1e-3));
  EXPECT_LT(ErrorAgainst(FrankePoint, fit.surface, 100).rms, 1.7e-4);
  EXPECT_NEAR(fit.report.noise_mm, 1e-3, 3e-5);
  EXPECT_NEAR(fit.report.neighbour_noise_mm, 1e-3, 1e-4);
  EXPECT_LT(std::abs(fit.report.neighbour_correlation), 0.08);
  EXPECT_THAT(fit.report.outliers, ::testing::IsEmpty());
  EXPECT_FALSE(fit.report.limited_by_density);
}

TEST(NestedFit, AClosedSurfaceInSpaceIsFoundAndCloses) {
  const NestedFitResult fit = FitAuto(Scattered(HeadPoint, 20000, 1e-4, 3), Closure::kPeriodicU);
  EXPECT_LT(ErrorAgainst(HeadPoint, fit.surface, 100).rms, 1.5e-4);
  const Vec3 left = fit.surface.Point({1 - 1e-12, 0.4}), right = fit.surface.Point({0, 0.4});
  EXPECT_LT((left - right).norm(), 1e-9);
}

// The place of the seam only affects which points are held out.
TEST(NestedFit, ATubeIsFoundEquallyWellWithItsSeamElsewhere) {
  FitTarget target = Scattered(HeadPoint, 10000, 1e-3, 3);
  const double here =
      ErrorAgainst(HeadPoint, FitAuto(target, Closure::kPeriodicU).surface, 100).rms;
  const Vec2 shift(3.0 / 8, 0);
  for (FitPoint& p : target.points) {
    p.uv.x() = IntoUnit(p.uv.x() + shift.x(), true);
  }
  const auto shifted = [&](const Vec2& uv) { return HeadPoint(uv - shift); };
  const double there = ErrorAgainst(shifted, FitAuto(target, Closure::kPeriodicU).surface, 100).rms;
  EXPECT_NEAR(there, here, 0.1 * here);
}

// On coarse levels the waves look like noise and are smoothed away. The weight that was chosen
// there must not persist on finer levels.
TEST(NestedFit, WavesThatLookLikeNoiseToCoarseLevelsAreFound) {
  const auto waves = [](const Vec2& q) {
    return Vec3(q.x(), q.y(), 0.06 * std::sin(2 * std::numbers::pi * 20 * (q.x() + 0.1 * q.y())));
  };
  const NestedFitResult fit = FitAuto(Heights(waves, 20000, 5e-3));
  EXPECT_LT(ErrorAgainst(waves, fit.surface, 150).rms, 5e-3);
  EXPECT_NEAR(fit.report.noise_mm, 5e-3, 5e-4);
}

// Waves along one oblique direction.
auto SlantingWaves(double count) {
  return [count](const Vec2& q) {
    const double along = 0.8 * q.x() + 0.6 * q.y();
    return Vec3(q.x(), q.y(), 0.06 * std::sin(2 * std::numbers::pi * count * along));
  };
}

// The points are too few for a smoothness that is the same in all directions.
TEST(NestedFit, WavesAlongOneDirectionNeedFewerPoints) {
  const auto waves = SlantingWaves(20);
  const FitTarget target = Heights(waves, 5000, 5e-3);
  const NestedFitResult fit = FitAuto(target),
                        alike = FitAuto(target, Closure::kOpen, {.stretched = false});
  const double rms = ErrorAgainst(waves, fit.surface, 150).rms;
  EXPECT_LT(rms, 8e-3);
  EXPECT_GT(ErrorAgainst(waves, alike.surface, 150).rms, 1.5 * rms);
  EXPECT_GT(fit.report.stretch, 2);
  EXPECT_NEAR(fit.report.direction_deg, 126.9, 10) << "along the crests";
  EXPECT_EQ(alike.report.stretch, 1);
}

// One point in twenty is an outlier, and all lie on one side.
TEST(NestedFit, OutliersAreFoundAndHaveNoEffect) {
  FitTarget target = Heights(FrankePoint, 10000, 1e-3);
  Random random(9);
  std::vector<std::uint32_t> gross;
  for (std::uint32_t k = 0; k < target.points.size(); ++k) {
    if (random.Uniform() < 0.05) {
      target.points[k].position.z() += random.Uniform(0.02, 2);
      gross.push_back(k);
    }
  }
  const NestedFitResult fit = FitAuto(target);
  EXPECT_LT(ErrorAgainst(FrankePoint, fit.surface, 100).rms, 1e-3);
  const auto& found = fit.report.outliers;
  std::vector<std::uint32_t> missed, wrong;
  std::set_difference(gross.begin(), gross.end(), found.begin(), found.end(),
                      std::back_inserter(missed));
  std::set_difference(found.begin(), found.end(), gross.begin(), gross.end(),
                      std::back_inserter(wrong));
  EXPECT_LE(missed.size(), gross.size() / 50);
  EXPECT_LE(wrong.size(), 20u);
  const NestedFitResult kept =
      FitAuto(target, Closure::kOpen, {.finest = 2, .outliers = OutlierRule::kKeep});
  EXPECT_THAT(kept.report.outliers, ::testing::IsEmpty());
  EXPECT_GT(ErrorAgainst(FrankePoint, kept.surface, 100).rms, 1e-2);
}

// A ridge that is half as wide as the points' spacing, 0.1 high: without it a surface errs by
// 7.9e-3. MBA at its best errs by about 5e-3.
TEST(NestedFit, ANarrowRidgeIsNoOutlier) {
  const auto ridge = [](const Vec2& uv) {
    const double across = std::cos(0.5) * uv.x() + std::sin(0.5) * uv.y() - 0.7;
    return Vec3(FrankePoint(uv) + Vec3(0, 0, 0.1 * std::exp(-std::pow(200 * across, 2))));
  };
  const NestedFitResult fit = FitAuto(Heights(ridge, 10000, 2e-3));
  EXPECT_LT(ErrorAgainst(ridge, fit.surface, 300).rms, 6.5e-3);
  EXPECT_LT(fit.report.outliers.size(), 40u);
}

// Trees on a ground also stand together, but no surface predicts which point is on a tree.
TEST(NestedFit, ClumpsOfGrossErrorsAreOutliers) {
  FitTarget target = Heights(FrankePoint, 10000, 2e-3);
  Random random(11);
  std::size_t gross = 0;
  for (int clump = 0; clump < 25; ++clump) {
    const Vec2 centre(random.Uniform(0, 1), random.Uniform(0, 1));
    for (FitPoint& p : target.points) {
      if ((p.uv - centre).norm() < 0.03 && random.Uniform() < 0.5) {
        p.position.z() += random.Uniform(0.05, 0.5);
        ++gross;
      }
    }
  }
  const NestedFitResult fit = FitAuto(target);
  EXPECT_GT(fit.report.outliers.size(), gross / 2);
  EXPECT_LT(ErrorAgainst(FrankePoint, fit.surface, 100).rms, 4e-3);
}

// As in a mesh whose layout squeezes most of its area, there are no points in the rest of the
// domain.
TEST(NestedFit, PointsCrowdedInACornerAreFollowedToTheirDetail) {
  constexpr double kCorner = 1.0 / 32;
  FitTarget target = Heights(FrankePoint, 3000, 0);
  for (FitPoint& p : target.points) {
    p.uv *= kCorner;
  }
  const NestedFitResult fit = FitAuto(target);
  EXPECT_GE(fit.surface.shape().max_level, 6);
  EXPECT_LT(fit.report.held_out_rms_mm, 1e-3);
}

// A wall between two sheets. A surface that is smooth everywhere is far from the points beside it.
Vec3 StepPoint(const Vec2& uv) {
  const double edge = 0.5 + 0.2 * std::sin(7 * uv.y());
  return {uv.x(), uv.y(), 0.02 * std::sin(9 * uv.x()) + (uv.x() < edge ? 0 : 1)};
}

TEST(NestedFit, PointsAtAStepAreNotOutliers) {
  const NestedFitResult fit = FitAuto(Heights(StepPoint, 4000, 1e-3));
  EXPECT_LE(fit.report.outliers.size(), 10u);
}

// There are so many gross errors that often two of eight neighbours are among them by chance.
TEST(NestedFit, GrossErrorsOfEqualSizeAreNotASheet) {
  FitTarget target = Heights(FrankePoint, 10000, 1e-3);
  Random random(9);
  std::size_t gross = 0;
  for (FitPoint& p : target.points) {
    const bool is = random.Uniform() < 0.15;
    p.position.z() += is ? 0.7 : 0;
    gross += is ? 1 : 0;
  }
  const NestedFitResult fit = FitAuto(target);
  EXPECT_NEAR(static_cast<double>(fit.report.outliers.size()), static_cast<double>(gross),
              0.1 * static_cast<double>(gross));
}

// Points with weight 1 / sigma^2. rough: whether a point has twenty times the noise of the others.
template <class IsRough>
FitTarget OfTwoKinds(int count, const IsRough& rough) {
  constexpr double kSigma = 1e-3;
  FitTarget target = Heights(FrankePoint, count, 0);
  Random random(4);
  for (int k = 0; k < count; ++k) {
    const double sigma = rough(k) ? 20 * kSigma : kSigma;
    target.points[k].position.z() += sigma * random.Normal();
    target.points[k].weight = 1 / (sigma * sigma);
  }
  return target;
}

NestedFitResult FitWeighted(const FitTarget& target) {
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;
  std::vector<double> weights;
  for (const FitPoint& p : target.points) {
    positions.push_back(p.position);
    uv.push_back(p.uv);
    weights.push_back(p.weight);
  }
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 0};
  return FitNested(StartSurface(shape, positions, uv), {positions, uv, weights}, {}, {});
}

// The ratio of the errors to the points' sigma, from the noise of a point of mean weight.
double SigmaFactor(const FitTarget& target, const AutoReport& report, double noise_mm) {
  double sum = 0;
  std::size_t count = 0;
  for (std::uint32_t k = 0; k < target.points.size(); ++k) {
    if (!std::binary_search(report.outliers.begin(), report.outliers.end(), k)) {
      sum += target.points[k].weight;
      ++count;
    }
  }
  return noise_mm * std::sqrt(sum / static_cast<double>(count));
}

// One point in five is rough, or all but one in five are.
TEST(NestedFit, PointsWithErrorsOfTheirSigmaAreNotOutliers) {
  for (const bool mostly_rough : {false, true}) {
    const FitTarget target = OfTwoKinds(10000, [&](int k) { return (k % 5 == 0) != mostly_rough; });
    const NestedFitResult fit = FitWeighted(target);
    EXPECT_LE(fit.report.outliers.size(), 10u) << mostly_rough;
    EXPECT_NEAR(SigmaFactor(target, fit.report, fit.report.noise_mm), 1, 0.03);
    EXPECT_NEAR(SigmaFactor(target, fit.report, fit.report.neighbour_noise_mm), 1, 0.1);
    EXPECT_NEAR(SigmaFactor(target, fit.report, fit.report.held_out_rms_mm), 1, 0.1);
    EXPECT_LT(std::abs(fit.report.neighbour_correlation), 0.08);
    EXPECT_LT(ErrorAgainst(FrankePoint, fit.surface, 100).rms, mostly_rough ? 5e-4 : 3e-4);
  }
}

// The outliers lie 25 sigma of rough points away, which is 500 sigma of the others.
TEST(NestedFit, OutliersAmongRoughAndPrecisePointsAreFound) {
  for (const bool mostly_rough : {false, true}) {
    FitTarget target = OfTwoKinds(10000, [&](int k) { return (k % 5 == 0) != mostly_rough; });
    std::vector<std::uint32_t> gross;
    for (std::uint32_t k = 0; k < target.points.size(); k += 21) {
      target.points[k].position.z() += k % 2 == 0 ? 0.5 : -0.5;
      gross.push_back(k);
    }
    const NestedFitResult fit = FitWeighted(target);
    const auto& found = fit.report.outliers;
    EXPECT_TRUE(std::includes(found.begin(), found.end(), gross.begin(), gross.end()))
        << mostly_rough;
    EXPECT_LE(found.size(), gross.size() + 10) << mostly_rough;
    EXPECT_NEAR(SigmaFactor(target, fit.report, fit.report.noise_mm), 1, 0.03);
  }
}

TEST(NestedFit, EqualWeightsChangeNothing) {
  FitTarget target = Heights(FrankePoint, 5000, 1e-3);
  for (std::size_t k = 0; k < target.points.size(); ++k) {
    target.points[k].position.z() += k % 50 == 0 ? 0.3 : 0;
    target.points[k].weight = 0.25;  // a power of two, so that no product is rounded otherwise
  }
  const NestedFitResult with = FitWeighted(target), without = FitAuto(target);
  EXPECT_EQ(with.report.outliers, without.report.outliers);
  EXPECT_EQ(with.surface.Net(0).vertices, without.surface.Net(0).vertices);
  EXPECT_EQ(with.surface.Offsets(), without.surface.Offsets());
  EXPECT_EQ(with.report.noise_mm, without.report.noise_mm);
  EXPECT_EQ(with.report.held_out_rms_mm, without.report.held_out_rms_mm);
  EXPECT_EQ(with.report.neighbour_noise_mm, without.report.neighbour_noise_mm);
}

// A paraboloid is a bicubic spline, so only round-off is left. Earlier, round-off caused thousands
// of vertices, or no usable smoothness.
TEST(NestedFit, AnExactShapeIsMetToRoundingAndNotRefined) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    Random random(seed);
    FitTarget target;
    const auto add = [&](const Vec2& uv, const Vec3& position) {
      target.points.push_back({.label = "", .position = position, .uv = uv});
    };
    while (target.points.size() < 4000) {
      const Vec2 p(random.Uniform(-40, 40), random.Uniform(-40, 40));
      if (p.norm() < 40 && p.norm() > 15) {
        add((p + Vec2(40, 40)) / 80, Vec3(p.x(), p.y(), 0.002 * p.squaredNorm()));
      }
    }
    add({0.5, 0.5}, {0, 0, 60});
    const NestedFitResult fit = FitAuto(target);
    EXPECT_TRUE(fit.report.met_to_rounding) << seed;
    EXPECT_FALSE(fit.report.limited_by_density) << seed;
    EXPECT_EQ(fit.surface.Offsets().size(), 0u) << seed;
    EXPECT_THAT(fit.report.outliers, ::testing::ElementsAre(4000u)) << seed;
    EXPECT_LT(*std::max_element(fit.residual_mm.begin(), fit.residual_mm.end() - 1), 3e-5) << seed;
    EXPECT_GE(fit.report.noise_mm, 0) << seed;
  }
}

// The shape has no noise, but is not a spline, so it is refined as far as the points allow.
TEST(NestedFit, AShapeWithoutNoiseThatIsNotASplineIsRefined) {
  const NestedFitResult fit = FitAuto(Heights(FrankePoint, 20000, 0));
  EXPECT_FALSE(fit.report.met_to_rounding);
  EXPECT_GE(fit.surface.shape().max_level, 2);
  EXPECT_LT(ErrorAgainst(FrankePoint, fit.surface, 100).rms, 1e-5);
}

TEST(NestedFit, TheOrderOfThePointsHasNoEffect) {
  FitTarget target = Heights(FrankePoint, 3000, 1e-3);
  const NestedFitResult first = FitAuto(target);
  std::reverse(target.points.begin(), target.points.end());
  // The start is a sum over the points in their given order, so its last digits differ.
  EXPECT_LT(ErrorAgainst([&](const Vec2& uv) { return first.surface.Point(uv); },
                         FitAuto(target).surface, 50)
                .largest,
            1e-9);
}

// Points come in close pairs. Residuals are either shared by the two points of a pair, or
// independent.
TEST(NestedFit, TheClosestPairsDistinguishDetailFromNoise) {
  NestedPoints points;
  points.channels = 1;
  std::vector<std::uint32_t> indices;
  std::vector<NestedResidual> shared, alone;
  Random random(4);
  for (std::uint32_t k = 0; k < 4000; ++k) {
    points.uv.emplace_back(k / 2 + 0.1 * (k % 2), 0);
    indices.push_back(k);
    alone.push_back({{random.Normal(), 0, 0}});
    shared.push_back(k % 2 == 0 ? NestedResidual{{random.Normal(), 0, 0}} : shared.back());
  }
  const PairCorrelation together = ClosestCorrelation(points, indices, shared),
                        apart = ClosestCorrelation(points, indices, alone);
  EXPECT_GT(together.Value(), 0.9);
  EXPECT_LT(std::abs(apart.Value()) * std::sqrt(static_cast<double>(apart.Count())), 4);
  PairCorrelation all;
  for (std::size_t k = 1; k < shared.size(); ++k) {
    all.Add(shared[k - 1], shared[k]);
  }
  EXPECT_NEAR(all.Value(), 0.5, 0.1);
}

// A fit to a target and a fit to columns give the same residuals.
TEST(NestedFit, ResidualsAreTheDistancesInTheOrderGiven) {
  const FitTarget target = Scattered(HeadPoint, 3000, 1e-3, 3);
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;
  for (const FitPoint& p : target.points) {
    positions.push_back(p.position);
    uv.push_back(p.uv);
  }
  const HSplineSurface start =
      StartSurface({.patches_u = 8, .patches_v = 8, .max_level = 0, .closure = Closure::kPeriodicU},
                   positions, uv);
  const FitOptions options{.plan = AutoPlan{},
                           .terms = {PointTerm{}, SmoothnessTerm{.weight = AutoOr<double>::Auto()}},
                           .solver = Solver::kFastest};
  const FitResult fit = Fit(start, {positions, uv}, options, {});
  double sum = 0;
  for (std::size_t k = 0; k < positions.size(); ++k) {
    EXPECT_NEAR(fit.residual_mm[k], (fit.surface.Point(uv[k]) - positions[k]).norm(), 1e-9);
    sum += fit.residual_mm[k] * fit.residual_mm[k];
  }
  EXPECT_NEAR(fit.point_rms_mm, std::sqrt(sum / 3000), 1e-12);
  EXPECT_EQ(fit.residual_mm, Fit(start, target, {}, options, {}).residual_mm);
}

TEST(NestedFit, APlaneIsReproduced) {
  const auto plane = [](const Vec2& q) { return Vec3(3 * q.x(), 2 * q.y() - q.x(), 0.5 * q.y()); };
  const NestedFitResult fit = FitAuto(Scattered(plane, 500, 0, 2));
  EXPECT_LT(ErrorAgainst(plane, fit.surface, 40).largest, 1e-10);
}

const Term kSmooth = SmoothnessTerm{.weight = AutoOr<double>::Auto()};

HSplineSurface PlaneUnder(const FitTarget& target) {
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;
  for (const FitPoint& p : target.points) {
    positions.push_back(p.position);
    uv.push_back(p.uv);
  }
  return StartSurface({.patches_u = 8, .patches_v = 8, .max_level = 0}, positions, uv);
}

FitResult FitBy(Solver solver, std::vector<Term> terms, const FitTarget& target) {
  return Fit(PlaneUnder(target), target, {},
             {.plan = AutoPlan{}, .terms = std::move(terms), .solver = solver}, {});
}

std::string Refusal(Solver solver, const Term& term) {
  return testing::WordsOf<InputError>([&] {
    FitBy(solver, {PointTerm{}, kSmooth, term}, Heights(FrankePoint, 100, 0));
  });
}

// Compares conjugate gradients with Ceres for the same space, smoothness and points, with outliers.
TEST(NestedFit, CeresFindsTheSameSurface) {
  FitTarget target = Heights(FrankePoint, 3000, 1e-3);
  for (std::size_t k = 0; k < target.points.size(); k += 100) {
    target.points[k].position.z() += 3;
  }
  const FitResult fastest = FitBy(Solver::kFastest, {PointTerm{}, kSmooth}, target);
  const Term smoothness = SmoothnessTerm{.weight = AutoOr<double>::Auto(), .length_mm = 0.1};
  for (const std::vector<Term>& terms : {std::vector<Term>{PointTerm{}, kSmooth},
                                         std::vector<Term>{PointTerm{.weight = 7}, smoothness}}) {
    const FitResult ceres = FitBy(Solver::kCeres, terms, target);
    EXPECT_EQ(ceres.automatic->outliers.size(), 30u);
    EXPECT_EQ(ceres.levels.back().solver, "ceres");
    EXPECT_LT(
        ErrorAgainst([&](const Vec2& uv) { return fastest.surface.Point(uv); }, ceres.surface, 60)
            .rms,
        1e-4);
    double before = 0, after = 0;
    for (const TermCosts& term : ceres.levels.back().terms) {
      before += term.before;
      after += term.after;
    }
    EXPECT_LE(after, before);
    EXPECT_LT(before, 1.001 * after) << "the plan stops where noise is larger than what is left";
    EXPECT_TRUE(ceres.usable);
  }
}

TEST(NestedFit, CeresFindsTheSameSurfaceWithAStretch) {
  const FitTarget target = Heights(SlantingWaves(4), 2000, 5e-3);
  const FitResult fastest = FitBy(Solver::kFastest, {PointTerm{}, kSmooth}, target),
                  ceres = FitBy(Solver::kCeres, {PointTerm{}, kSmooth}, target);
  EXPECT_GT(ceres.automatic->stretch, 2);
  EXPECT_LT(
      ErrorAgainst([&](const Vec2& uv) { return fastest.surface.Point(uv); }, ceres.surface, 60)
          .rms,
      1e-3);
}

// The membrane is so stiff that the surface hardly rises over its start.
TEST(NestedFit, WithCeresOtherTermsTakePart) {
  const FitTarget target = Heights(FrankePoint, 3000, 1e-3);
  const HSplineSurface start = PlaneUnder(target);
  const FitResult fit = FitBy(
      Solver::kCeres, {PointTerm{}, kSmooth, MembraneTerm{.weight = 1e4, .length_mm = 1}}, target);
  const auto from_start = [&](const HSplineSurface& surface) {
    const Vec3 mean = surface.Point({0.5, 0.5}) - start.Point({0.5, 0.5});
    return ErrorAgainst([&](const Vec2& uv) -> Vec3 { return start.Point(uv) + mean; }, surface, 40)
        .rms;
  };
  EXPECT_GT(from_start(FitBy(Solver::kFastest, {PointTerm{}, kSmooth}, target).surface), 0.1);
  EXPECT_LT(from_start(fit.surface), 1e-3);
  EXPECT_GT(fit.automatic->noise_mm, 0.1) << "of this surface, not of that without the membrane";
  EXPECT_GT(fit.automatic->neighbour_correlation, 0.5);
  EXPECT_TRUE(std::isnan(fit.automatic->held_out_rms_mm));
  EXPECT_THAT(Refusal(Solver::kFastest, MembraneTerm{}), HasSubstr("need solver: ceres"));
  EXPECT_THAT(Refusal(Solver::kCeres, MembraneTerm{.weight = AutoOr<double>::Auto()}),
              HasSubstr("one 'smoothness'"));
  const Term stretched = SmoothnessTerm{.weight = AutoOr<double>::Auto(), .stretch = 2};
  EXPECT_THAT(testing::WordsOf<InputError>([&] {
                FitBy(Solver::kFastest, {PointTerm{}, stretched}, target);
              }),
              HasSubstr("whose stretch it finds"));
}

TEST(NestedFit, UnusableInputIsNamed) {
  const FitTarget few = Scattered(FrankePoint, 10, 0, 1);
  EXPECT_THROW(FitAuto(few), InputError);
  HSplineSurface detailed = testing::PlainStart({.patches_u = 8, .patches_v = 8, .max_level = 1});
  detailed.SetOffsets({{{1, 5, 5}, Vec3(0, 0, 1)}});
  const std::vector<Vec3> positions(100, Vec3::Zero());
  const std::vector<Vec2> uv(100, Vec2::Constant(0.5));
  EXPECT_THROW(FitNested(detailed, {positions, uv}, {}, {}), InputError);
}

// The written surface is the measured one for either reference of offsets.
TEST(NestedFit, OffsetsAlongTheAxesOfTheWorldGiveTheSameSurface) {
  const FitTarget target = Scattered(HeadPoint, 5000, 1e-3, 4);
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;
  for (const FitPoint& p : target.points) {
    positions.push_back(p.position);
    uv.push_back(p.uv);
  }
  HSplineShape shape{
      .patches_u = 8, .patches_v = 8, .max_level = 0, .closure = Closure::kPeriodicU};
  const NestedFitResult frame =
      FitNested(StartSurface(shape, positions, uv), {positions, uv}, {}, {});
  shape.reference = OffsetReference::kWorld;
  const NestedFitResult world =
      FitNested(StartSurface(shape, positions, uv), {positions, uv}, {}, {});
  ASSERT_GT(world.surface.Offsets().size(), 10u);
  for (std::size_t k = 0; k < uv.size(); k += 50) {
    EXPECT_LT((world.surface.Point(uv[k]) - frame.surface.Point(uv[k])).norm(), 1e-9);
    EXPECT_NEAR((world.surface.Point(uv[k]) - positions[k]).norm(), world.residual_mm[k], 1e-9);
  }
}

}  // namespace
}  // namespace semblance::fitting
