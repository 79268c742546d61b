// SPDX-License-Identifier: GPL-3.0-or-later
// Properties of inverse_distance, radial_basis and moving_least_squares beyond the laws of every
// scheme.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "interp/dowels/dowel_samples.h"
#include "interp/interpolate_depth.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::Count;
using testing::DomeScene;
using testing::DowelScene;
using testing::FlatScene;
using testing::ScatteredScene;

DepthField FieldAt(const DepthScheme& scheme, const DowelScene& scene, std::vector<Vec3> points) {
  DowelScene at = scene.At(std::move(points));
  at.network.areas.clear();
  return InterpolateDepth(scheme, at.Input(), RunContext{});
}
std::vector<double> DepthsAt(const DepthScheme& scheme, const DowelScene& scene,
                             std::vector<Vec3> points) {
  return FieldAt(scheme, scene, std::move(points)).depth_mm;
}

double LinearDepth(const Vec3& p) { return 8 + 0.03 * p.x() - 0.02 * p.y() + 0.01 * p.z(); }

DowelScene WithLinearDepths(DowelScene scene) {
  for (Dowel& dowel : scene.dowels) {
    dowel.depth_mm = LinearDepth(dowel.base);
  }
  return scene;
}

TEST(DowelSamples, OfOnePlaceBecomeTheirMean) {
  DowelScene scene = FlatScene();
  scene.dowels[1].base = scene.dowels[3].base;
  const std::vector<DepthSample> samples = DepthSamples(scene.dowels);
  ASSERT_EQ(samples.size(), 3u);
  EXPECT_EQ(samples[0].depth_mm, 6);  // g 7 and rhi 5
  EXPECT_EQ(samples[0].sd_mm, 1.75);
  EXPECT_EQ(samples[1].depth_mm, 9);  // n
  EXPECT_EQ(samples[2].depth_mm, 4);  // sg
}

TEST(SampleFrame, HasTheDirectionsInWhichThePointsSpread) {
  DowelScene scene = FlatScene();
  const SampleFrame plane = FindSampleFrame(DepthSamples(scene.dowels));
  EXPECT_EQ(plane.axes.size(), 2u);
  EXPECT_NEAR(plane.size_mm, 15 * std::sqrt(2), 1e-12);
  EXPECT_NEAR((plane.center - Vec3(20, 20, 0)).norm(), 0, 1e-12);
  EXPECT_EQ(FindSampleFrame(DepthSamples(DomeScene().dowels)).axes.size(), 3u);
  scene.dowels.resize(2);
  EXPECT_EQ(FindSampleFrame(DepthSamples(scene.dowels)).axes.size(), 1u);
  scene.dowels.resize(1);
  EXPECT_TRUE(FindSampleFrame(DepthSamples(scene.dowels)).axes.empty());
}

TEST(ScatteredSchemes, WorkWithOneDowelAndWithTwoInOnePlace) {
  for (const DepthScheme& scheme : {DepthScheme{InverseDistance{}}, DepthScheme{RadialBasis{}},
                                    DepthScheme{RadialBasis{.kernel = RadialKernel::kCubic}},
                                    DepthScheme{RadialBasis{.kernel = RadialKernel::kGaussian}},
                                    DepthScheme{MovingLeastSquares{}}}) {
    DowelScene scene = FlatScene();
    scene.dowels.resize(1);
    EXPECT_NEAR(DepthsAt(scheme, scene, {{20, 9, 1}})[0], 4, 1e-9);
    scene = FlatScene();
    scene.dowels[1].base = scene.dowels[3].base;
    const double merged = DepthsAt(scheme, scene, {scene.dowels[3].base})[0];
    EXPECT_NEAR(merged, 6, std::holds_alternative<MovingLeastSquares>(scheme) ? 1.5 : 1e-9);
  }
}

TEST(InverseDistance, WeighsByTheDistanceToThePower) {
  DowelScene scene = FlatScene();
  scene.dowels.resize(2);  // 4 at x = 5, 7 at x = 35
  const Vec3 p(15, 5, 0);  // twice as far from the second
  EXPECT_NEAR(DepthsAt(InverseDistance{.power = 1}, scene, {p})[0], (4 + 7 / 2.) / 1.5, 1e-12);
  EXPECT_NEAR(DepthsAt(InverseDistance{.power = 2}, scene, {p})[0], (4 + 7 / 4.) / 1.25, 1e-12);
  EXPECT_NEAR(DepthsAt(InverseDistance{.power = 16}, scene, {p})[0], 4, 1e-4);
  EXPECT_NEAR(FieldAt(InverseDistance{.power = 2}, scene, {p}).sd_mm[0], (1 + 2 / 4.) / 1.25,
              1e-12);
  scene.dowels[1].sd_mm = kNaN;
  EXPECT_TRUE(std::isnan(FieldAt(InverseDistance{}, scene, {p}).sd_mm[0]));
}

TEST(InverseDistance, IsTheMeanFarAway) {
  EXPECT_NEAR(DepthsAt(InverseDistance{}, FlatScene(), {{0, 0, 1e7}})[0], 6.25, 1e-4);
}

class RadialKernels : public ::testing::TestWithParam<RadialKernel> {};
INSTANTIATE_TEST_SUITE_P(All, RadialKernels,
                         ::testing::Values(RadialKernel::kLinear, RadialKernel::kCubic,
                                           RadialKernel::kGaussian, RadialKernel::kWendlandC2),
                         [](const auto& each) {
                           return std::string(EnumNames(each.param)[static_cast<int>(each.param)]);
                         });

TEST_P(RadialKernels, MeetEveryDowel) {
  const DowelScene scene = ScatteredScene(40);
  std::vector<Vec3> bases;
  for (const Dowel& dowel : scene.dowels) {
    bases.push_back(dowel.base);
  }
  DowelScene at = scene.At(bases);
  for (const int degree : {0, 1}) {
    const RadialBasis rbf{.kernel = GetParam(), .tail_degree = degree, .max_angle_deg = 180};
    const DepthField field = InterpolateDepth(rbf, at.Input(), RunContext{});
    for (std::size_t k = 0; k < bases.size(); ++k) {
      ASSERT_NEAR(field.depth_mm[k], scene.dowels[k].depth_mm, 1e-6) << degree;
    }
  }
}

TEST_P(RadialKernels, ReproduceALinearDepthWithALinearTail) {
  const RadialBasis rbf{.kernel = GetParam(), .clamp = false, .max_angle_deg = 180};
  const std::vector<Vec3> points = {{10, -80, 20}, {-30, -60, 45}, {5, 40, -70}};
  const std::vector<double> depths = DepthsAt(rbf, WithLinearDepths(ScatteredScene(40)), points);
  for (std::size_t k = 0; k < points.size(); ++k) {
    EXPECT_NEAR(depths[k], LinearDepth(points[k]), 1e-8);
  }
}

TEST_P(RadialKernels, SmoothingLeadsToTheTail) {
  const RadialBasis rbf{.kernel = GetParam(), .tail_degree = 0, .smoothing = 1e6, .clamp = false};
  const DowelScene scene = FlatScene();
  const double expected = GetParam() == RadialKernel::kCubic ? 3.75 : 6.25;  // plane, or mean
  EXPECT_NEAR(DepthsAt(rbf, scene, {{5, 5, 0}})[0], expected, 1e-4);
}

TEST(RadialBasis, ClampKeepsTheDowelsRange) {
  const DowelScene scene = WithLinearDepths(FlatScene());
  const Vec3 far(1000, 20, 0), below(-1000, 20, 0);
  const std::vector<double> free = DepthsAt(RadialBasis{.clamp = false}, scene, {far, below});
  EXPECT_NEAR(free[0], LinearDepth(far), 1e-6);
  EXPECT_NEAR(free[1], 0.1 * LinearDepth({5, 35, 0}), 1e-12);  // not below 0
  const std::vector<double> clamped = DepthsAt(RadialBasis{}, scene, {far, below});
  EXPECT_NEAR(clamped[0], LinearDepth({35, 5, 0}), 1e-12);
  EXPECT_NEAR(clamped[1], LinearDepth({5, 35, 0}), 1e-12);
}

TEST(RadialBasis, WendlandHasNoEffectBeyondItsWidth) {
  DowelScene scene = FlatScene();
  const RadialBasis rbf{.kernel = RadialKernel::kWendlandC2, .width_mm = 20, .tail_degree = 0};
  const std::vector<double> before = DepthsAt(rbf, scene, {{20, 20, 0}, {6, 5, 0}, {90, 90, 0}});
  EXPECT_NEAR(before[0], before[2], 1e-12);  // the tail alone, 21 mm from each dowel
  EXPECT_GT(std::abs(before[1] - before[2]), 1);
}

TEST(MovingLeastSquares, ReproducesALinearDepthWhereTheDowelsSpread) {
  const MovingLeastSquares mls{.width_mm = 60, .thin_mm = 1e-3, .max_angle_deg = 180};
  const Vec3 p(10, -80, 20);
  EXPECT_NEAR(DepthsAt(mls, WithLinearDepths(ScatteredScene(40)), {p})[0], LinearDepth(p), 1e-6);
}

TEST(MovingLeastSquares, KeepsHalfOfTheSlopeAtTheThinLength) {
  DowelScene scene = FlatScene();
  scene.dowels.resize(2);  // 4 and 7 at x = 5 and 35: a spread of 15 mm
  const auto at = [&](double thin) {
    return DepthsAt(MovingLeastSquares{.width_mm = 1e4, .thin_mm = thin}, scene, {{35, 5, 0}})[0];
  };
  EXPECT_NEAR(at(1e-3), 7, 1e-4);
  EXPECT_NEAR(at(15), 6.25, 1e-4);
  EXPECT_NEAR(at(1e3), 5.5, 1e-3);
}

TEST(MovingLeastSquares, IsTheNearestDowelFarAwayAndTheMeanWithAGreatWidth) {
  EXPECT_NEAR(DepthsAt(MovingLeastSquares{}, FlatScene(), {{4000, 4000, 0}})[0], 9, 1e-9);
  const MovingLeastSquares wide{.width_mm = 1e4, .thin_mm = 1e3};
  EXPECT_NEAR(DepthsAt(wide, FlatScene(), {{20, 20, 0}})[0], 6.25, 1e-4);
}

}  // namespace
}  // namespace semblance::interp
