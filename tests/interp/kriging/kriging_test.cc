// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/kriging/kriging.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "interp/kriging/kriging_process.h"
#include "surfaces/base/random.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::DowelScene;
using testing::FlatScene;
using testing::ScatteredScene;

DepthField FieldAt(const Kriging& options, const DowelScene& scene, std::vector<Vec3> points) {
  DowelScene at = scene.At(std::move(points));
  at.network.areas.clear();
  return InterpolateDepth(options, at.Input(), RunContext{});
}

DepthProcess ModelOf(const Kriging& options, DowelScene scene) {
  scene.network.areas.clear();
  return FitKriging(options, scene.Input(), RunContext{});
}

// Depths along x, sums of noise in a moving window: their covariance falls linearly to 0 at
// `length`.
DowelScene RoughScene(int count, double spacing_mm, double length_mm, std::uint64_t random_seed) {
  Random random(random_seed);
  const int window = static_cast<int>(length_mm / spacing_mm);
  std::vector<double> noise;
  for (int k = 0; k < count + window; ++k) {
    noise.push_back(random.Uniform(-1, 1) + random.Uniform(-1, 1) + random.Uniform(-1, 1));
  }
  DowelScene scene;
  for (int k = 0; k < count; ++k) {
    double depth = 20;
    for (int w = 0; w < window; ++w) {
      depth += 2 * noise[k + w] / std::sqrt(window);
    }
    scene.dowels.push_back(
        {std::to_string(1000 + k), {k * spacing_mm, 0, 0}, {0, 0, 1}, depth, kNaN});
  }
  scene.skull.points = {{0, 0, 0}};
  scene.normals = {{0, 0, 1}};
  return scene;
}

TEST(Kriging, OfTwoDowelsIsTheClosedForm) {
  DowelScene scene = FlatScene();
  scene.dowels.resize(2);  // 4 at x = 5 and 7 at x = 35
  const Kriging kriging{
      .covariance = Covariance::kMatern12, .length_mm = 30, .signal_mm = 2, .nugget_share = 0};
  const Vec3 p(15, 5, 0);
  // Mean 5.5 by symmetry; weights of the residuals -1.5, 1.5 are -+1.5 / (1 - e^-1).
  const double near = std::exp(-10 / 30.), far = std::exp(-20 / 30.), both = std::exp(-1.0);
  const DepthField field = FieldAt(kriging, scene, {p});
  EXPECT_NEAR(field.depth_mm[0], 5.5 + 1.5 * (far - near) / (1 - both), 1e-8);
  const double explained = (near * near + far * far - 2 * both * near * far) / (1 - both * both);
  const double of_mean = 1 - (near + far) / (1 + both);
  const double variance = 4 * (1 - explained + of_mean * of_mean * (1 + both) / 2);
  EXPECT_NEAR(field.sd_mm[0], std::sqrt(variance), 1e-8);
}

TEST(Kriging, CovariancesAreTheirFormulas) {
  DowelScene scene = FlatScene();
  scene.dowels.resize(2);
  const std::vector<double> at_30mm = {
      std::exp(-1.0), (1 + std::sqrt(3.0)) * std::exp(-std::sqrt(3.0)),
      (1 + std::sqrt(5.0) + 5 / 3.) * std::exp(-std::sqrt(5.0)), std::exp(-0.5)};
  for (int k = 0; k < 4; ++k) {
    // With a large nugget on both, the residual's factor is c(0) - c(30) over c(0) - c(30) plus the
    // nugget.
    const Kriging kriging{.covariance = static_cast<Covariance>(k),
                          .length_mm = 30,
                          .signal_mm = 1,
                          .nugget_share = 1};
    scene.dowels[0].sd_mm = scene.dowels[1].sd_mm = 3;
    const double share = (1 - at_30mm[k]) / (1 - at_30mm[k] + 9);
    EXPECT_NEAR(FieldAt(kriging, scene, {{5, 5, 0}}).depth_mm[0], 5.5 - 1.5 * share, 1e-8) << k;
  }
}

TEST(Kriging, SdIsNoneAtACertainDowelAndGrowsAwayFromIt) {
  DowelScene scene = FlatScene();
  const Kriging certain{.length_mm = 30, .signal_mm = 2, .nugget_share = 0};
  const DepthField field =
      FieldAt(certain, scene, {{5, 5, 0}, {7, 5, 0}, {20, 20, 0}, {20, 20, 60}, {0, 0, 1e5}});
  EXPECT_NEAR(field.sd_mm[0], 0, 1e-4);
  for (int k = 1; k < 5; ++k) {
    EXPECT_GT(field.sd_mm[k], field.sd_mm[k - 1] + 0.05);
  }
  EXPECT_GT(field.sd_mm[4], 2);  // the signal, and an uncertain mean
  EXPECT_LT(field.sd_mm[4], 3);
}

TEST(Kriging, AnUncertainDowelIsSmoothedAndLeavesAnSd) {
  const DowelScene scene = FlatScene();  // sg: 4 +- 1
  const DepthField field = FieldAt({.length_mm = 30, .signal_mm = 2}, scene, {{5, 5, 0}});
  EXPECT_GT(field.depth_mm[0], 4.05);
  EXPECT_GT(field.sd_mm[0], 0.5);
  EXPECT_LT(field.sd_mm[0], 1);
}

TEST(Kriging, WithoutStateSdGivesTheSameDepthsAndNone) {
  const DowelScene scene = FlatScene();
  const DepthField with = FieldAt({}, scene, {{20, 10, 0}});
  const DepthField without = FieldAt({.state_sd = false}, scene, {{20, 10, 0}});
  EXPECT_EQ(with.depth_mm, without.depth_mm);
  EXPECT_TRUE(std::isfinite(with.sd_mm[0]));
  EXPECT_TRUE(std::isnan(without.sd_mm[0]));
}

int StatedSds(const DepthField& field) {
  return static_cast<int>(
      std::ranges::count_if(field.sd_mm, [](double sd) { return std::isfinite(sd); }));
}

// Its signal is then at the lower bound, and its sd would be some nanometres.
TEST(Kriging, StatesNoSdIfTheDowelsDetermineOnlyTheMean) {
  DowelScene one = FlatScene();
  one.dowels.resize(1);
  one.dowels[0].sd_mm = kNaN;
  const DepthField field = FieldAt({}, one, {{20, 10, 0}});
  EXPECT_EQ(field.depth_mm[0], 4);
  EXPECT_EQ(StatedSds(field), 0);
  EXPECT_EQ(StatedSds(FieldAt({.signal_mm = 2}, one, {{20, 10, 0}})), 1);
  DowelScene two = FlatScene();
  two.dowels.resize(2);
  EXPECT_EQ(StatedSds(FieldAt({}, two, {{20, 10, 0}})), 1);
  const Kriging relief{.mean = DepthMean::kCovariates};
  EXPECT_EQ(StatedSds(InterpolateDepth(relief, ScatteredScene(3).Input(), {})), 0);
  EXPECT_GT(StatedSds(InterpolateDepth(relief, ScatteredScene(4).Input(), {})), 0);
}

// Distances that no Euclidean space has: near to three dowels that are far from each other.
TEST(KrigingProcess, StatesNoSdWhereTheVarianceIsNegative) {
  KrigingData data{1000 * (Eigen::Matrix3d::Ones() - Eigen::Matrix3d::Identity()),
                   Eigen::Vector3d(4, 5, 6), Eigen::Vector3d::Zero(), Eigen::MatrixXd::Ones(3, 1)};
  KrigingProcess process(Covariance::kSquaredExponential, data, {.length_mm = 30, .signal_mm = 2});
  process.PrepareSd();
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(1);
  const DepthValue near_all = process.ValueAt(Eigen::Vector3d(10, 10, 10), one);
  EXPECT_TRUE(std::isfinite(near_all.mm));
  EXPECT_TRUE(std::isnan(near_all.sd_mm));
  EXPECT_GT(process.ValueAt(Eigen::Vector3d(10, 1000, 1000), one).sd_mm, 0.1);
  // At a dowel the sd is 0 only if the field interpolates the dowel.
  EXPECT_TRUE(std::isnan(process.ValueAt(Eigen::Vector3d(0, 10, 10), one).sd_mm));
  data.depth_mm.setConstant(5);
  KrigingProcess through(Covariance::kSquaredExponential, data, {.length_mm = 30, .signal_mm = 2});
  through.PrepareSd();
  EXPECT_EQ(through.ValueAt(Eigen::Vector3d(0, 10, 10), one).sd_mm, 0);
}

KrigingData KrigingDataAt(const DowelScene& scene) {
  const auto n = static_cast<Eigen::Index>(scene.dowels.size());
  KrigingData data{Eigen::MatrixXd(n, n), Eigen::VectorXd(n), Eigen::VectorXd::Zero(n),
                   Eigen::MatrixXd::Ones(n, 1)};
  for (Eigen::Index j = 0; j < n; ++j) {
    const Dowel& dowel = scene.dowels[j];
    data.depth_mm[j] = dowel.depth_mm;
    data.nugget_mm2[j] = std::isfinite(dowel.sd_mm) ? dowel.sd_mm * dowel.sd_mm : 0;
    for (Eigen::Index k = 0; k < n; ++k) {
      data.distance_mm(j, k) = (dowel.base - scene.dowels[k].base).norm();
    }
  }
  return data;
}

class EveryCovariance : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Kriging, EveryCovariance, ::testing::Range(0, 4));

TEST_P(EveryCovariance, GradientOfTheDevianceEqualsItsNumericTwin) {
  const auto covariance = static_cast<Covariance>(GetParam());
  const DowelScene scene = ScatteredScene(20);
  const KrigingData data = KrigingDataAt(scene);
  const auto deviance = [&](const Vec2& logs) {
    return KrigingProcess(covariance, data, {std::exp(logs[0]), std::exp(logs[1])}).Deviance();
  };
  const Vec2 logs(std::log(25.0), std::log(2.0));
  const Vec2 exact =
      KrigingProcess(covariance, data, {std::exp(logs[0]), std::exp(logs[1])}).DevianceGradient();
  constexpr double kStep = 1e-4;
  for (int k = 0; k < 2; ++k) {
    const Vec2 step = kStep * Vec2::Unit(k);
    const double numeric = (deviance(logs + step) - deviance(logs - step)) / (2 * kStep);
    EXPECT_NEAR(exact[k], numeric, 1e-5 * (1 + std::abs(numeric)));
  }
}

// A long length makes the covariances nearly singular; a variance that round-off makes negative is
// 0.
TEST_P(EveryCovariance, StatesAnSdEverywhereWithStraightDistances) {
  DowelScene scene = ScatteredScene(120);
  scene.network.areas.clear();
  for (const double length_mm : {20.0, 200.0, 2000.0}) {
    const Kriging kriging{.covariance = static_cast<Covariance>(GetParam()),
                          .length_mm = length_mm,
                          .signal_mm = 2,
                          .max_angle_deg = 180};
    const DepthField field = InterpolateDepth(kriging, scene.Input(), {});
    EXPECT_EQ(StatedSds(field), std::ssize(field.sd_mm)) << length_mm;
  }
}

TEST_P(EveryCovariance, FitIsNoWorseThanAnyPointOfADenseGrid) {
  const Kriging free{.covariance = static_cast<Covariance>(GetParam())};
  DowelScene scene = ScatteredScene(25);
  scene.network.areas.clear();
  const DepthProcess best = ModelOf(free, scene);
  const KrigingData data = KrigingDataAt(scene);
  const auto cost = [&](double length_mm, double signal_mm) {
    const double away = std::log(length_mm / free.length_prior_mm) / free.length_prior_spread;
    return KrigingProcess(free.covariance, data, {length_mm, signal_mm}).Deviance() + away * away;
  };
  const double least = cost(best.length_mm, best.signal_mm);
  for (double length_mm = 10; length_mm < 400; length_mm *= 1.1) {
    for (double signal_mm = 0.2; signal_mm < 20; signal_mm *= 1.1) {
      EXPECT_GE(cost(length_mm, signal_mm), least - 1e-6) << length_mm << " " << signal_mm;
    }
  }
}

TEST(KrigingFit, FindsTheLengthAndTheSignalOfManyDowels) {
  const Kriging free{.covariance = Covariance::kMatern12, .length_prior_spread = 10};
  std::vector<double> lengths;
  for (const double length : {25.0, 100.0}) {
    const DepthProcess model = ModelOf(free, RoughScene(180, 5, length, 3));
    EXPECT_NEAR(model.signal_mm, 2, 0.7);
    EXPECT_NEAR(model.mean_mm, 20, 2);
    lengths.push_back(model.length_mm);
  }
  EXPECT_GT(lengths[1], 2 * lengths[0]);
  EXPECT_GT(lengths[0], 5);
  EXPECT_LT(lengths[1], 200);
}

TEST(KrigingFit, APriorFixesTheLengthThatFewDowelsDoNotDetermine) {
  const DowelScene scene = ScatteredScene(5);
  const double held = ModelOf({.length_prior_spread = 0.05}, scene).length_mm;
  EXPECT_NEAR(held, 60, 6);
  EXPECT_NEAR(ModelOf({.length_prior_mm = 30, .length_prior_spread = 0.05}, scene).length_mm, 30,
              3);
}

TEST(KrigingFit, KeepsWhatTheOptionsFix) {
  const DowelScene scene = ScatteredScene(30);
  const DepthProcess both = ModelOf({.length_mm = 33, .signal_mm = 1.5}, scene);
  EXPECT_EQ(both.length_mm, 33);
  EXPECT_EQ(both.signal_mm, 1.5);
  EXPECT_NEAR(ModelOf({.length_mm = 33}, scene).length_mm, 33, 1e-12);
  EXPECT_NEAR(ModelOf({.signal_mm = 1.5}, scene).signal_mm, 1.5, 1e-12);
}

// Without nuggets the best signal^2 at any length is r'R^-1 r / (n - q).
TEST_P(EveryCovariance, FitOfALongLengthFindsTheClosedForm) {
  const auto covariance = static_cast<Covariance>(GetParam());
  DowelScene scene = ScatteredScene(12);
  scene.network.areas.clear();
  for (Dowel& dowel : scene.dowels) {
    dowel.sd_mm = kNaN;
  }
  const KrigingData data = KrigingDataAt(scene);
  const auto n = data.depth_mm.size();
  for (const double length_mm : {60.0, 1000.0, 10000.0}) {
    Eigen::MatrixXd r = 1e-10 * Eigen::MatrixXd::Identity(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index k = 0; k < n; ++k) {
        r(j, k) += CorrelationAt(covariance, data.distance_mm(j, k), length_mm).value;
      }
    }
    const Eigen::VectorXd one = Eigen::VectorXd::Ones(n);
    const Eigen::LDLT<Eigen::MatrixXd> factor(r);
    const double mean = factor.solve(data.depth_mm).sum() / factor.solve(one).sum();
    const Eigen::VectorXd residual = data.depth_mm - mean * one;
    const double best = std::sqrt(residual.dot(factor.solve(residual)) / (n - 1));
    const DepthProcess found = ModelOf({.covariance = covariance, .length_mm = length_mm}, scene);
    EXPECT_NEAR(found.signal_mm / best, 1, 1e-3) << length_mm;
    EXPECT_TRUE(found.at_end.empty());
  }
}

TEST(KrigingFit, ReportsParametersAtTheirBounds) {
  DowelScene scene = ScatteredScene(12);
  EXPECT_TRUE(ModelOf({}, scene).at_end.empty());
  for (std::size_t k = 0; k < scene.dowels.size(); ++k) {  // differences smaller than their
                                                           // uncertainty
    scene.dowels[k].depth_mm = k % 2 == 0 ? 9 : 11;
    scene.dowels[k].sd_mm = 1.5;
  }
  EXPECT_THAT(ModelOf({}, scene).at_end,
              ::testing::Contains(::testing::HasSubstr("is the least that is searched")));
  EXPECT_TRUE(ModelOf({.length_mm = 60, .signal_mm = 1}, scene).at_end.empty());
}

TEST(KrigingFit, ComesWithTheField) {
  const DowelScene scene = ScatteredScene(20);
  const DepthProcess found = FitKriging(Kriging{}, scene.Input(), RunContext{});
  const DepthField field = InterpolateDepth(Kriging{}, scene.Input(), RunContext{});
  ASSERT_TRUE(field.process.has_value());
  EXPECT_EQ(field.process->length_mm, found.length_mm);
  EXPECT_EQ(field.process->signal_mm, found.signal_mm);
  EXPECT_EQ(field.process->nugget_mm, 0);
  EXPECT_EQ(field.process->mean_mm, found.mean_mm);
}

TEST(KrigingFit, ScalesWithTheDepths) {
  const DowelScene scene = RoughScene(60, 5, 50, 11);
  const Kriging free{.covariance = Covariance::kMatern12};
  const DepthProcess best = ModelOf(free, scene);
  DowelScene scaled = scene;
  for (Dowel& dowel : scaled.dowels) {
    dowel.depth_mm *= 3;
  }
  const DepthProcess three = ModelOf(free, scaled);
  EXPECT_NEAR(three.length_mm / best.length_mm, 1, 0.01);
  EXPECT_NEAR(three.signal_mm / best.signal_mm, 3, 0.03);
  EXPECT_NEAR(three.mean_mm / best.mean_mm, 3, 0.03);
}

TEST(KrigingFit, CoversTheDepthsOfItsOwnProcess) {
  const DowelScene all = RoughScene(160, 5, 60, 5);
  DowelScene half = all;
  half.dowels.clear();
  std::vector<Vec3> asked;
  std::vector<double> truth;
  for (std::size_t k = 0; k < all.dowels.size(); ++k) {
    if (k % 2 == 0) {
      half.dowels.push_back(all.dowels[k]);
    } else {
      asked.push_back(all.dowels[k].base);
      truth.push_back(all.dowels[k].depth_mm);
    }
  }
  const DepthField field =
      FieldAt({.covariance = Covariance::kMatern12, .clamp = false}, half, asked);
  int covered = 0;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    covered += std::abs(field.depth_mm[k] - truth[k]) <= 1.645 * field.sd_mm[k];
  }
  EXPECT_NEAR(covered, 72, 7);  // 90 % of 80
}

// The diagonal holds the stated variances. The other entries are the effect of another dowel at q,
// which reduces the variance at p by cov(p, q)^2 / var(q).
TEST(Kriging, TheCovarianceIsTheEffectOfAnotherDowel) {
  DowelScene scene = ScatteredScene(12);
  scene.network.areas.clear();
  const Kriging kriging{.length_mm = 25, .signal_mm = 3, .clamp = false};
  std::vector<Vec3> places;
  for (std::size_t k = 0; k + 1 < scene.dowels.size() && k < 4; ++k) {
    places.push_back((2 * scene.dowels[k].base + scene.dowels[k + 1].base) / 3);
  }
  const DepthPosterior posterior = KrigingPosterior(kriging, scene.Input(), places, RunContext{});
  const Eigen::MatrixXd& covariance = posterior.covariance;
  const DepthField field = FieldAt(kriging, scene, places);
  DowelScene more = scene;
  more.dowels.push_back({"zzz", places[0], scene.dowels[0].direction, 9, kNaN});
  const Eigen::MatrixXd after =
      KrigingPosterior(kriging, more.Input(), places, RunContext{}).covariance;
  for (std::size_t p = 0; p < places.size(); ++p) {
    EXPECT_NEAR(covariance(p, p), std::pow(field.sd_mm[p], 2), 1e-8);
    EXPECT_NEAR(posterior.mean_mm[p], field.depth_mm[p], 1e-9);
    for (std::size_t q = 0; q < places.size(); ++q) {
      const double told = covariance(p, 0) * covariance(q, 0) / covariance(0, 0);
      EXPECT_NEAR(after(p, q), covariance(p, q) - told, 1e-6);
      EXPECT_EQ(covariance(p, q), covariance(q, p));
    }
  }
}

}  // namespace
}  // namespace semblance::interp
