// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/distance_kernel.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "surfaces/base/random.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

struct Emitting {
  Vec3 a, b, c, normal = Vec3::Zero();
  double advance_mm = 0, floor_mm = 0, gain = 0;
};

Emitting RandomTriangle(Random& random) {
  Emitting t{random.InBox(-4, 4), random.InBox(-4, 4), random.InBox(-4, 4)};
  t.normal = (t.b - t.a).cross(t.c - t.a).normalized();
  t.advance_mm = random.Uniform(0, 1) < 0.3 ? 0 : random.Uniform(1, 5);
  t.floor_mm = random.Uniform(0.1, 0.4);
  t.gain = random.Uniform(1, 1e4);
  return t;
}

// The emitters of thesis 3.1 and 3.2, computed from the closest point.
double Emission(const Emitting& t, const Vec3& p, const Falloff& falloff) {
  const double height = (p - t.a).dot(t.normal);
  const Vec3 from = p - t.advance_mm * t.normal;
  const TrianglePoint closest = ClosestPointOnTriangle(from, t.a, t.b, t.c);
  const double distance = (from - closest.position).norm();
  if (height <= 0) {
    return 0;
  }
  if (height < t.advance_mm) {
    const bool over = std::abs(distance - (t.advance_mm - height)) < 1e-9;
    return over ? kMaxEmission : 0;
  }
  const double emission = t.gain * std::pow(std::max(distance, t.floor_mm), -falloff.power);
  return emission < falloff.cut ? 0 : std::min(emission, kMaxEmission);
}

class DistanceKernelTest : public ::testing::TestWithParam<Falloff> {};
INSTANTIATE_TEST_SUITE_P(Decays, DistanceKernelTest,
                         ::testing::Values(Falloff{6, 6, false, 0}, Falloff{3, 3, false, 0.01},
                                           Falloff{15, 15, false, 0},
                                           Falloff{4.5, -1, false, 0.01}));

TEST_P(DistanceKernelTest, EachLaneIsTheThesisAndTheSumIsTheLanes) {
  Random random(21);
  for (int n = 0; n < 500; ++n) {
    DistanceEmitterLanes lanes;
    std::vector<Emitting> triangles;
    const int set = n % (DistanceEmitterLanes::kLanes + 1);
    for (int lane = 0; lane < set; ++lane) {
      const Emitting t = triangles.emplace_back(RandomTriangle(random));
      lanes.Set(lane, t.a, t.b, t.c, t.normal, t.advance_mm, t.floor_mm, t.gain);
    }
    const Vec3 p = n % 2 == 0 ? random.InBox(-9, 9) : random.InBox(-40, 40);  // also out of reach
    DistanceEmitterLanes::Lanes emission;
    for (int lane = 0; lane < DistanceEmitterLanes::kLanes; ++lane) {
      emission[lane] = EmitByDistance(lanes, lane, p, GetParam());
    }
    const std::vector<DistanceEmitterLanes> one = {lanes};
    const std::vector<ReachBall> reaches = MakeReachBalls(one, GetParam());
    const double sum = ((emission[0] + emission[1]) + (emission[2] + emission[3])) +
                       ((emission[4] + emission[5]) + (emission[6] + emission[7]));
    std::int64_t reaching = 0;
    const auto sum_of = [&](const std::vector<std::int32_t>& which) {
      return SumByDistance(one, which, Gather(reaches, which), p, GetParam(), reaching);
    };
    EXPECT_EQ(sum_of({0}), sum);
    EXPECT_GE(reaching, std::ranges::count_if(emission, [](double e) { return e > 0; }));
    EXPECT_LE(reaching, DistanceEmitterLanes::kLanes);
    EXPECT_EQ(sum_of({0, 0}), 2 * sum);
    EXPECT_NEAR(sum_of({0, 0, 0, 0, 0}), 5 * sum, 1e-12 * sum);  // more balls than one pass takes
    for (int lane = 0; lane < DistanceEmitterLanes::kLanes; ++lane) {
      const double expected = lane < set ? Emission(triangles[lane], p, GetParam()) : 0;
      EXPECT_NEAR(emission[lane], expected, 1e-9 * expected) << n << " " << lane;
    }
  }
}

}  // namespace
}  // namespace semblance::surfaces
