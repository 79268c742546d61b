// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/phantom_relief.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace semblance {
namespace {

constexpr RoughnessOptions kField{.sd = 3, .length_mm = 20, .shortest_mm = 4, .radius_mm = 90};

// Over many fields: the mean product of the values at two directions some way apart.
double Covariance(double apart_mm, const RoughnessOptions& options) {
  constexpr int kFields = 200, kPairs = 20;
  Random random(1);
  double sum = 0;
  for (int i = 0; i < kFields; ++i) {
    const WaveSum field = DrawRoughness(options, random);
    for (int k = 0; k < kPairs; ++k) {
      const Vec3 a = random.Direction(), aside = a.unitOrthogonal();
      sum += field.Value(a) * field.Value(a + apart_mm / options.radius_mm * aside);
    }
  }
  return sum / (kFields * kPairs);
}

TEST(Roughness, HasTheExponentialCovariance) {
  for (const double apart_mm : {0.0, 5.0, 10.0, 20.0, 40.0}) {
    EXPECT_NEAR(Covariance(apart_mm, kField), 9 * std::exp(-apart_mm / 20), 0.7) << apart_mm;
  }
}

TEST(Roughness, HasNoWaveShorterThanAsked) {
  Random random(2);
  for (const WaveSum::Wave& w : DrawRoughness(kField, random).waves) {
    EXPECT_LE(w.wave_number.norm() / kField.radius_mm, 2 * std::acos(-1) / kField.shortest_mm);
  }
}

TEST(PhantomRelief, LeavesTwoMillimetresAndThickensWithTheSmoothTissue) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    Random random(seed);
    const PhantomRelief relief(random);
    EXPECT_GT(relief.Weight(), 0.7);
    EXPECT_LT(relief.Weight(), 1.3);
    for (int i = 0; i < 1000; ++i) {
      const Vec3 direction = random.Direction();
      EXPECT_GT(relief.Thickness(direction, 0.01), 2);
      EXPECT_LT(relief.Thickness(direction, 5), relief.Thickness(direction, 8));
    }
  }
}

TEST(PhantomRelief, TissueIsThickBesideTheTeethAndThinOverTheNasalBones) {
  double hollow_mm = 0, ridge_mm = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const PhantomRelief relief(random);
    hollow_mm += relief.Thickness(PhantomDirection({37, 28, -62}), 10) / 20;
    ridge_mm += relief.Thickness(PhantomDirection({0, -10, -21}), 10) / 20;
  }
  EXPECT_GT(hollow_mm, 18);
  EXPECT_LT(ridge_mm, 10);
}

}  // namespace
}  // namespace semblance
