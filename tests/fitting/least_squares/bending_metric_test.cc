// SPDX-License-Identifier: GPL-3.0-or-later
// Stretched lengths, against the definition of bending and brute force over stretches.
#include "fitting/least_squares/bending_metric.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <vector>

#include "surfaces/base/random.h"

namespace semblance {
namespace {

using Eigen::Matrix2d;

// Second derivatives at many places, which bend `more` times as much across a direction as along
// it.
std::vector<Matrix2d> Hessians(double direction_deg, double more, std::uint64_t seed) {
  Random random(seed);
  const double turn = direction_deg * std::numbers::pi / 180;
  const Matrix2d axes = Eigen::Rotation2Dd(turn).toRotationMatrix();
  std::vector<Matrix2d> all;
  for (int k = 0; k < 500; ++k) {
    const double along = random.Normal(), mixed = random.Normal(), across = random.Normal();
    Matrix2d h;
    h << along, mixed * more, mixed * more, across * more * more;
    all.emplace_back(axes * h * axes.transpose());
  }
  return all;
}

BendingSums SumsOf(const std::vector<Matrix2d>& hessians) {
  BendingSums sums{};
  for (const Matrix2d& h : hessians) {
    const double ss = h(0, 0), st = h(0, 1), tt = h(1, 1);
    const BendingSums here = {ss * ss, st * st, tt * tt, ss * st, st * tt, ss * tt};
    for (std::size_t k = 0; k < sums.size(); ++k) {
      sums[k] += here[k];
    }
  }
  return sums;
}

TEST(BendingMetric, HasItsStretchAndDirection) {
  for (const double stretch : {1.5, 4.0, 20.0}) {
    for (const double direction_deg : {0.0, 10.0, 90.0, 135.0, 179.0}) {
      const BendingMetric metric = MetricOf({.stretch = stretch, .direction_deg = direction_deg});
      EXPECT_NEAR(metric.determinant(), 1, 1e-12);
      const BendingStretch found = StretchOf(metric);
      EXPECT_NEAR(found.stretch, stretch, 1e-9);
      const double apart = std::abs(found.direction_deg - direction_deg);
      EXPECT_LT(std::min(apart, 180 - apart), 1e-6) << "0 and 180 degrees are one direction";
      EXPECT_NEAR(StretchBetween(BendingMetric::Identity(), metric), stretch, 1e-6 * stretch);
      EXPECT_NEAR(StretchBetween(metric, metric), 1, 1e-5);
    }
  }
  EXPECT_EQ(MetricOf({}), BendingMetric::Identity());
  EXPECT_EQ(StretchOf(BendingMetric::Identity()).stretch, 1);
}

TEST(BendingMetric, CountsBendingAsDefined) {
  const std::vector<Matrix2d> hessians = Hessians(20, 2, 1);
  const BendingMetric metric = MetricOf({.stretch = 3, .direction_deg = 70});
  double bending = 0;
  for (const Matrix2d& h : hessians) {
    bending += (metric * h * metric * h).trace();
  }
  EXPECT_NEAR(BendingIn(metric, SumsOf(hessians)), bending, 1e-10 * bending);
}

TEST(BendingMetric, NoOtherBendsLess) {
  for (const double direction_deg : {0.0, 30.0, 90.0, 160.0}) {
    const BendingSums sums = SumsOf(Hessians(direction_deg, 3, 2));
    const BendingMetric found = MetricOfLeastBending(sums, 100);
    const double least = BendingIn(found, sums);
    for (double stretch = 1; stretch < 20; stretch *= 1.1) {
      for (int turn_deg = 0; turn_deg < 180; turn_deg += 5) {
        const BendingMetric other =
            MetricOf({.stretch = stretch, .direction_deg = static_cast<double>(turn_deg)});
        EXPECT_GE(BendingIn(other, sums), (1 - 1e-9) * least);
      }
    }
    const BendingStretch stretch = StretchOf(found);
    EXPECT_NEAR(stretch.stretch, 3, 0.3);
    EXPECT_NEAR(std::cos((stretch.direction_deg - direction_deg) * std::numbers::pi / 90), 1, 0.01);
    EXPECT_NEAR(StretchOf(MetricOfLeastBending(sums, 2)).stretch, 2, 1e-9);
  }
}

TEST(BendingMetric, OfAPlaneIsThePlanesOwn) {
  EXPECT_EQ(MetricOfLeastBending({}, 100), BendingMetric::Identity());
}

TEST(BendingMetric, GoesAsFarBeyond) {
  const BendingMetric one = MetricOf({.stretch = 2, .direction_deg = 30}),
                      beyond = MetricBeyond(BendingMetric::Identity(), one, 100);
  EXPECT_NEAR(StretchOf(beyond).stretch, 4, 1e-9);
  EXPECT_NEAR(StretchOf(beyond).direction_deg, 30, 1e-6);
  EXPECT_NEAR(StretchOf(MetricBeyond(BendingMetric::Identity(), one, 3)).stretch, 3, 1e-9);
  const BendingMetric other = MetricOf({.stretch = 5, .direction_deg = 100});
  EXPECT_NEAR(StretchBetween(one, MetricBeyond(other, one, 1e6)), StretchBetween(other, one), 1e-4);
}

}  // namespace
}  // namespace semblance
