// SPDX-License-Identifier: GPL-3.0-or-later
// Properties of network_spline beyond the laws of every scheme: no creases where barycentric has
// them.
#include "interp/schemes/network_schemes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::DomeScene;
using testing::DowelScene;
using testing::FlatScene;

template <class Scheme>
double DepthAt(const DowelScene& scene, Scheme scheme, const Vec3& p) {
  scheme.max_angle_deg = 180;
  return InterpolateDepth(scheme, scene.At({p}).Input(), RunContext{}).depth_mm[0];
}

// Slope at p across a plane, from each of its sides: second-order one-sided differences.
template <class Scheme>
std::pair<double, double> SlopesAcross(const DowelScene& scene, const Scheme& scheme, const Vec3& p,
                                       const Vec3& normal) {
  constexpr double h = 1e-3;
  const auto at = [&](double step) { return DepthAt(scene, scheme, p + step * normal); };
  const auto slope = [&](double s) { return (4 * at(s) - at(2 * s) - 3 * at(0.0)) / (2 * s); };
  return {slope(h), slope(-h)};
}

constexpr NetworkSpline kFree{.clamp = false};

// The dome's shared edges n - mso_r, n - mso_l, sg - n and n - me, and the normals of their cutting
// planes.
struct Crossing {
  Vec3 p, normal;
};
std::vector<Crossing> Crossings(const DowelScene& scene) {
  std::vector<Crossing> crossings;
  Random random(5);
  for (const auto& [i, j] : {std::pair(3, 2), {3, 1}, {0, 3}, {3, 4}}) {
    const Dowel &a = scene.dowels[i], &b = scene.dowels[j];
    const Vec3 along = b.base - a.base, out = (a.direction + b.direction).normalized();
    for (int k = 0; k < 5; ++k) {
      const Vec3 p = a.base + random.Uniform(0.1, 0.9) * along + random.Uniform(-6, 12) * out;
      crossings.push_back({p, out.cross(along).normalized()});
    }
  }
  return crossings;
}

TEST(NetworkSpline, HasNoCreaseAcrossACuttingPlaneWhereBarycentricHas) {
  const DowelScene scene = DomeScene();
  double largest_crease = 0;
  for (const Crossing& at : Crossings(scene)) {
    const auto [one, other] = SlopesAcross(scene, kFree, at.p, at.normal);
    EXPECT_NEAR(one, other, 2e-5);
    const auto [side, far_side] = SlopesAcross(scene, Barycentric{}, at.p, at.normal);
    largest_crease = std::max(largest_crease, std::abs(side - far_side));
  }
  EXPECT_GT(largest_crease, 0.05);
}

TEST(NetworkSpline, DoesNotJumpAcrossACuttingPlaneOffTheBasesPlane) {
  const DowelScene scene = DomeScene();
  for (const Crossing& at : Crossings(scene)) {
    constexpr double kStep = 1e-7;
    EXPECT_NEAR(DepthAt(scene, kFree, at.p + kStep * at.normal),
                DepthAt(scene, kFree, at.p - kStep * at.normal), 1e-6);
  }
}

TEST(NetworkSpline, IsSmoothWithinAnAreaAndAtItsDowels) {
  const DowelScene scene = FlatScene();
  Random random(3);
  for (int k = 0; k < 20; ++k) {
    const Vec3 p(random.Uniform(6, 34), random.Uniform(6, 34), 0);
    const Vec3 way = Vec3(random.Uniform(-1, 1), random.Uniform(-1, 1), 0).normalized();
    const auto [one, other] = SlopesAcross(scene, kFree, p, way);
    EXPECT_NEAR(one, other, 2e-5);
  }
  // In both directions away from a dowel inside the network, the dome's n.
  const DowelScene dome = DomeScene();
  for (const Vec3& way : {Vec3(1, 0, 0), Vec3(0.6, 0, 0.8), Vec3(-0.6, 0, 0.8)}) {
    const auto [one, other] = SlopesAcross(dome, kFree, dome.dowels[3].base, way);
    EXPECT_NEAR(one, other, 1e-3);
  }
}

TEST(NetworkSpline, LinearDepthsOnAPlaneAreReproducedAlsoWithObliqueDowels) {
  Random random(11);
  for (const bool oblique : {false, true}) {
    DowelScene scene = FlatScene();
    const auto depth = [](const Vec3& p) { return 3 + 0.1 * p.x() + 0.05 * p.y(); };
    for (Dowel& dowel : scene.dowels) {
      dowel.depth_mm = depth(dowel.base);
      if (oblique) {
        dowel.direction = (dowel.direction + 0.4 * random.InBox(-1, 1)).normalized();
      }
    }
    for (int k = 0; k < 50; ++k) {
      const Vec3 p(random.Uniform(8, 32), random.Uniform(8, 32), 0);
      EXPECT_NEAR(DepthAt(scene, kFree, p), depth(p), 1e-7);
    }
  }
}

// With the four dowels of a square on a paraboloid the diagonal's cubic bends like the data, where
// barycentric is flat.
TEST(NetworkSpline, IsCloserToACurvedDepthThanBarycentric) {
  DowelScene scene;
  const auto depth = [](const Vec3& p) { return 6 + p.squaredNorm() / 200; };
  for (int j = 0; j < 5; ++j) {
    for (int i = 0; i < 5; ++i) {
      const Vec3 base(10.0 * i - 20, 10.0 * j - 20, 0);
      scene.dowels.push_back({std::to_string(100 + 5 * j + i), base, {0, 0, 1}, depth(base), 1});
      if (i > 0 && j > 0) {
        const int d = 5 * j + i;
        scene.network.areas.push_back({d - 6, d - 5, d});
        scene.network.areas.push_back({d - 6, d, d - 1});
      }
    }
  }
  Random random(2);
  double spline = 0, linear = 0;
  for (int k = 0; k < 200; ++k) {
    const Vec3 p(random.Uniform(-9, 9), random.Uniform(-9, 9), 0);
    spline += std::pow(DepthAt(scene, kFree, p) - depth(p), 2);
    linear += std::pow(DepthAt(scene, Barycentric{}, p) - depth(p), 2);
  }
  EXPECT_LT(spline, 0.1 * linear);
}

TEST(NetworkSpline, ClampsToTheDowelsRangeAndHasBarycentricsStatusAndSd) {
  DowelScene scene = DomeScene();
  const DepthField clamped = InterpolateDepth(NetworkSpline{}, scene.Input(), RunContext{});
  const DepthField linear = InterpolateDepth(Barycentric{}, scene.Input(), RunContext{});
  EXPECT_EQ(clamped.status, linear.status);
  EXPECT_TRUE(testing::SameBytes(clamped.sd_mm, linear.sd_mm));
}

TEST(NetworkSpline, NeedsAnArea) {
  DowelScene scene = FlatScene();
  scene.network.areas.clear();
  try {
    InterpolateDepth(NetworkSpline{}, scene.Input(), RunContext{});
    FAIL() << "nothing was thrown";
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(),
                 "dowel network: there is no area, but network_spline depth needs at least one; "
                 "place the dowels of an area, or use the scheme nearest or mean");
  }
}

}  // namespace
}  // namespace semblance::interp
