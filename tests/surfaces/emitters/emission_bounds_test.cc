// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/emission_bounds.h"

#include <gtest/gtest.h>

#include <cmath>

#include "surfaces/base/random.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

// Triangles are not moved if the falloff depends on the height.
EmitterTriangle RandomEmitter(Random& random, const Falloff& falloff) {
  EmitterTriangle t;
  t.a = random.InBox(-4, 4);
  t.b = t.a + random.InBox(-2, 2);
  t.c = t.a + random.InBox(-2, 2);
  t.normal = (t.b - t.a).cross(t.c - t.a).normalized();
  t.moved = falloff.by_height || random.Uniform(0, 1) < 0.5 ? Vec3(Vec3::Zero())
                                                            : Vec3(random.Uniform(0, 3) * t.normal);
  t.most_gain = random.Uniform(1, 1e3);
  return t;
}

// Computed from the closest point of the triangle at its place of emission.
double Emission(const EmitterTriangle& t, const Vec3& p, const Falloff& falloff) {
  const double height = (p - t.a).dot(t.normal);
  const Vec3 from = p - t.moved;
  const double distance = (from - ClosestPointOnTriangle(from, t.a, t.b, t.c).position).norm();
  const double emission =
      t.most_gain * std::pow(distance, -falloff.power) * (falloff.by_height ? height : 1);
  return height <= 0 || emission < falloff.cut ? 0 : emission;
}

class EmissionUpperBoundTest : public ::testing::TestWithParam<Falloff> {};
INSTANTIATE_TEST_SUITE_P(Falls, EmissionUpperBoundTest,
                         ::testing::Values(Falloff{6, 6, false, 0}, Falloff{3, 3, false, 0.01},
                                           Falloff{9, 9, true, 0}, Falloff{7.5, -1, true, 0}));

// No point of the box has a larger emission than the bound, and the bound is tight.
TEST_P(EmissionUpperBoundTest, IsNotLessThanWhatAnyPointOfTheBoxGets) {
  Random random(31);
  int zeros = 0, near = 0;
  for (int n = 0; n < 300; ++n) {
    EmissionUpperBound lanes;
    std::vector<EmitterTriangle> triangles;
    for (int lane = 0; lane < EmissionUpperBound::kLanes; ++lane) {
      lanes.Set(lane, triangles.emplace_back(RandomEmitter(random, GetParam())));
    }
    const Vec3 center = random.InBox(-20, 20), half = random.InBox(0.1, 2);
    EmissionUpperBound::Lanes most;
    UpperBoundInBox(lanes, center, half, GetParam(), most);
    for (int lane = 0; lane < EmissionUpperBound::kLanes; ++lane) {
      double greatest = 0;
      for (int k = 0; k < 60; ++k) {
        const Vec3 p = center + half.cwiseProduct(random.InBox(-1, 1));
        const double emission = Emission(triangles[lane], p, GetParam());
        ASSERT_LE(emission, most[lane]) << n << " " << lane;
        greatest = std::max(greatest, emission);
      }
      zeros += most[lane] == 0 ? 1 : 0;
      near += greatest > 0 && most[lane] < 10 * greatest ? 1 : 0;
    }
  }
  EXPECT_GT(zeros, 300);  // behind their planes, or cut off
  EXPECT_GT(near, 300);
}

TEST_P(EmissionUpperBoundTest, IsInfiniteWhereTheBoxMayMeetTheTriangle) {
  Random random(32);
  for (int n = 0; n < 100; ++n) {
    EmissionUpperBound lanes;
    const EmitterTriangle t = RandomEmitter(random, GetParam());
    for (int lane = 0; lane < EmissionUpperBound::kLanes; ++lane) {
      lanes.Set(lane, t);
    }
    EmissionUpperBound::Lanes most;
    UpperBoundInBox(lanes, (t.a + t.b + t.c) / 3 + 0.5 * t.moved, Vec3::Constant(0.3), GetParam(),
                    most);
    for (const double bound : most) {
      EXPECT_TRUE(std::isinf(bound));
    }
  }
}

}  // namespace
}  // namespace semblance::surfaces
