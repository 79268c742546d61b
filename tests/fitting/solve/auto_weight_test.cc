// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/auto_weight.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "fitting/fit.h"
#include "surfaces/base/error.h"
#include "tests/testing/scattered_data.h"

namespace semblance::fitting {
namespace {

using testing::ErrorAgainst;
using testing::FrankePoint;
using ::testing::HasSubstr;
using testing::PlainStart;
using testing::Scattered;

const HSplineShape kShape{.patches_u = 12, .patches_v = 12, .max_level = 0};

std::vector<Term> Terms(AutoOr<double> weight) {
  return {PointTerm{}, SmoothnessTerm{.weight = weight, .length_mm = 1}};
}

FitOptions Options(AutoOr<double> weight, Solver solver = Solver::kFastest) {
  return {.plan = ListedPlan{.schedule = {{0, 1}}}, .terms = Terms(weight), .solver = solver};
}

double CleanRms(const FitTarget& target, AutoOr<double> weight) {
  return ErrorAgainst(FrankePoint, Fit(PlainStart(kShape), target, {}, Options(weight), {}).surface,
                      60)
      .rms;
}

// The oracle uses the truth and tries every decade; the choice uses the noisy points alone.
TEST(AutoWeight, IsNearlyAsGoodAsTheOracle) {
  for (const double noise : {0.003, 0.03, 0.1}) {
    const FitTarget target = Scattered(FrankePoint, 600, noise, 4);
    double best = 1e300, worst = 0;
    for (double exponent = -12; exponent <= 0; exponent += 1) {
      const double rms = CleanRms(target, std::pow(10, exponent));
      best = std::min(best, rms);
      worst = std::max(worst, rms);
    }
    const double chosen = CleanRms(target, AutoOr<double>::Auto());
    EXPECT_LT(chosen, 1.2 * best) << noise;
    EXPECT_LT(chosen, 0.8 * worst) << noise;
  }
}

TEST(AutoWeight, MoreNoiseIsSmoothedMore) {
  double before = 0;
  for (const double noise : {0.001, 0.01, 0.1}) {
    const FitTarget target = Scattered(FrankePoint, 1500, noise, 4);
    const FitResult result =
        Fit(PlainStart(kShape), target, {}, Options(AutoOr<double>::Auto()), {});
    const double weight = result.levels[0].auto_weight;
    EXPECT_GT(weight, before);
    before = weight;
  }
}

// The chosen weight as a number gives the same surface. Without `auto` no weight is reported.
TEST(AutoWeight, IsTheWeightThatIsReported) {
  const FitTarget target = Scattered(FrankePoint, 600, 0.03, 4);
  for (const Solver solver : {Solver::kFastest, Solver::kCeres}) {
    const FitResult a =
        Fit(PlainStart(kShape), target, {}, Options(AutoOr<double>::Auto(), solver), {});
    const FitResult b =
        Fit(PlainStart(kShape), target, {}, Options(a.levels[0].auto_weight, solver), {});
    EXPECT_EQ(a.point_rms_mm, b.point_rms_mm);
    EXPECT_TRUE(std::isnan(b.levels[0].auto_weight));
  }
}

// Computes the influence matrix by brute force, row by row.
TEST(AutoWeight, TheScoreIsThatOfCravenAndWahba) {
  const FitTarget target = Scattered(FrankePoint, 150, 0.03, 4);
  const int n = 150;
  const HSplineSurface start = PlainStart({.patches_u = 4, .patches_v = 4, .max_level = 0});
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, 49), e(n, 3);
  for (int k = 0; k < n; ++k) {
    const Stencil s = start.StencilAt(0, target.points[k].uv);
    for (int v = 0; v < 16; ++v) {
      a(k, s.index[v]) += s.weight[v] / std::sqrt(n);
    }
    e.row(k) = (target.points[k].position - start.Point(target.points[k].uv)) / std::sqrt(n);
  }
  const Eigen::MatrixXd smooth = Eigen::MatrixXd::Identity(49, 49), none;
  const WeightChoice choice =
      ChooseWeight({.points = {(a.transpose() * a).sparseView(), a.transpose() * e},
                    .smooth = {smooth.sparseView(), Eigen::MatrixX3d::Zero(49, 3)},
                    .fixed = {},
                    .misfit = e.squaredNorm(),
                    .count = n});
  const auto score = [&](double weight) {
    const Eigen::MatrixXd influence =
        a * (a.transpose() * a + weight * smooth).inverse() * a.transpose();
    return (e - influence * e).squaredNorm() / std::pow(1 - influence.trace() / n, 2);
  };
  EXPECT_NEAR(choice.score, score(choice.weight), 1e-6 * choice.score);
  for (const double factor : {0.3, 0.5, 2.0, 3.0}) {
    EXPECT_LT(choice.score, 1.02 * score(factor * choice.weight));
  }
}

TEST(AutoWeight, AHoleIsBridgedByTheAdaptiveFitToo) {
  const HSplineShape shape{.patches_u = 16, .patches_v = 16, .max_level = 2};
  FitTarget target = Scattered(FrankePoint, 20000, 1e-3, 9);
  std::erase_if(target.points, [](const FitPoint& p) {
    return (p.uv - Vec2(0.5, 0.5)).cwiseAbs().maxCoeff() < 0.15;
  });
  const FitOptions options{.plan = AdaptivePlan{.tolerance_mm = 6e-3, .finest = 2},
                           .terms = Terms(AutoOr<double>::Auto())};
  const FitResult result = Fit(PlainStart(shape), target, {}, options, {});
  EXPECT_GT(result.levels.back().auto_weight, 0);
  EXPECT_LT(ErrorAgainst(FrankePoint, result.surface, 100).largest, 0.1);
}

TEST(AutoWeight, WrongInputIsNamed) {
  const FitTarget target = Scattered(FrankePoint, 100, 0, 9);
  const auto message = [&](std::vector<Term> terms) -> std::string {
    try {
      Fit(PlainStart(kShape), target, {},
          {.plan = ListedPlan{.schedule = {{0, 1}}},
           .terms = std::move(terms),
           .solver = Solver::kFastest},
          {});
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  const SmoothnessTerm smooth{.weight = AutoOr<double>::Auto()};
  const MembraneTerm membrane{.weight = AutoOr<double>::Auto()};
  EXPECT_THAT(message({PointTerm{}, smooth, membrane}), HasSubstr("both have weight: auto"));
  EXPECT_THAT(message({PointTerm{}, smooth, SymmetryTerm{}}), HasSubstr("'symmetry'"));
  EXPECT_EQ(message({PointTerm{.loss = RobustLoss::kHuber}, smooth}), "");
}

// No point exceeds the width of the loss, so the weights never change. Many unknowns are held by a
// tiny smoothness alone, along which reweighting could continue without end.
TEST(AutoWeight, ALossThatMeetsNoOutlierIsSolvedOnce) {
  const FitTarget target = Scattered(FrankePoint, 100, 0, 9);
  const SmoothnessTerm smooth{.weight = AutoOr<double>::Auto()};
  const auto fit = [&](RobustLoss loss) {
    return Fit(PlainStart(kShape), target, {},
               {.plan = ListedPlan{.schedule = {{0, 1}}},
                .terms = {PointTerm{.loss = loss}, smooth},
                .solver = Solver::kCeres},
               {});
  };
  const FitResult with = fit(RobustLoss::kHuber), without = fit(RobustLoss::kNone);
  EXPECT_EQ(with.levels[0].termination, "convergence");
  EXPECT_EQ(with.levels[0].iterations, 1);
  EXPECT_NEAR(with.point_rms_mm, without.point_rms_mm, 1e-9);
}

}  // namespace
}  // namespace semblance::fitting
