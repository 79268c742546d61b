// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/terms/metric_distortion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "fitting/problem/placement.h"
#include "tests/testing/splines.h"

namespace semblance::fitting {
namespace {

using testing::RandomSurface;

HSplineSurface Template() {
  return RandomSurface({.patches_u = 4, .patches_v = 3, .max_level = 2}, 5);
}

const auto kEverywhere = [](const Vec3&) { return true; };

TEST(MetricDistortion, IsZeroForAMovedSurfaceAndExactForAScaledOne) {
  const HSplineSurface rest = Template();
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).matrix();
  const auto moved = [&](double scale) {
    return MeasureDistortion(
        Transformed(rest, {.scale = scale, .rotation = turn, .translation = Vec3(1, 2, 3)}), rest,
        kEverywhere);
  };
  EXPECT_LT(moved(1).max_strain, 1e-10);
  EXPECT_LT(moved(1).rms_area, 1e-10);
  EXPECT_NEAR(moved(1.1).rms_strain, std::sqrt(2) * 0.105, 1e-10);
  EXPECT_NEAR(moved(1.1).max_strain, std::sqrt(2) * 0.105, 1e-10);
  EXPECT_NEAR(moved(1.1).rms_area, 0.21, 1e-10);
}

TEST(MetricDistortion, CoversOnlyTheWantedPlaces) {
  const HSplineSurface rest = Template();
  HSplineSurface surface = rest;
  // The offset moves columns 6..9 of 16 and rows 2..5 of 12 of the patches.
  surface.SetOffsets({{{2, 9, 5}, Vec3(1, 2, 3)}});
  const Vec3 place = rest.Point(rest.GrevillePoint({2, 9, 5}));
  const auto near = [&](const Vec3& p) { return (p - place).norm() < 8; };
  const auto far = [&](const Vec3& p) { return p.z() > 60; };
  const MetricDistortion all = MeasureDistortion(surface, rest, kEverywhere),
                         there = MeasureDistortion(surface, rest, near),
                         elsewhere = MeasureDistortion(surface, rest, far),
                         nowhere =
                             MeasureDistortion(surface, rest, [](const Vec3&) { return false; });
  EXPECT_GT(there.rms_strain, 2 * all.rms_strain);
  EXPECT_GT(there.rms_strain, 1e-2);
  EXPECT_LT(there.area_cm2, 0.5 * all.area_cm2);
  EXPECT_GT(elsewhere.area_cm2, 0);
  EXPECT_LT(elsewhere.rms_strain, 1e-12);
  EXPECT_TRUE(std::isnan(nowhere.rms_strain));
}

TEST(MetricDistortion, AreaIsTheIntegralOfTheJacobian) {
  const HSplineSurface rest = Template();
  double area = 0;
  constexpr int kSide = 200;
  for (int k = 0; k < kSide * kSide; ++k) {
    area += rest.Frame(Vec2((k % kSide + 0.5) / kSide, (k / kSide + 0.5) / kSide)).Jacobian();
  }
  EXPECT_NEAR(MeasureDistortion(rest, rest, kEverywhere).area_cm2, area / kSide / kSide / 100,
              0.05);
}

}  // namespace
}  // namespace semblance::fitting
