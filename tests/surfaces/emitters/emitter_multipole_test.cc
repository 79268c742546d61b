// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/emitter_multipole.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "surfaces/base/random.h"
#include "surfaces/emitters/implicit_surface.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

// Triangles of a bumpy sheet that faces up, within 1 of the origin. sloped: with linear depth.
std::vector<EmitterTriangle> Sheet(Random& random, int count, double bumps, bool sloped) {
  std::vector<EmitterTriangle> sheet;
  while (static_cast<int>(sheet.size()) < count) {
    EmitterTriangle t;
    const Vec3 at(random.Uniform(-0.6, 0.6), random.Uniform(-0.6, 0.6), 0);
    const auto near = [&] {
      return Vec3(at + random.InBox(-0.3, 0.3).cwiseProduct(Vec3(1, 1, bumps)));
    };
    t.a = near();
    t.b = near();
    t.c = near();
    Vec3 area = 0.5 * (t.b - t.a).cross(t.c - t.a);
    if (area.z() < 0) {
      std::swap(t.b, t.c);
      area = -area;
    }
    t.area_mm2 = area.norm();
    t.normal = area / t.area_mm2;
    t.centroid = (t.a + t.b + t.c) / 3;
    t.gain = random.Uniform(0.5, 2) * t.area_mm2;
    if (sloped) {
      t.least_share = 0.93;
      t.most_share = 1.07;
      t.slope = 0.1 * t.normal.cross(random.InBox(-1, 1));
    }
    sheet.push_back(t);
  }
  return sheet;
}

// The integral by 4^6 parts of each triangle.
double Emission(const std::vector<EmitterTriangle>& sheet, int decay, const Vec3& p) {
  constexpr int kParts = 64;
  double sum = 0;
  for (const EmitterTriangle& t : sheet) {
    double mean = 0;
    for (int i = 0; i < kParts; ++i) {
      for (int j = 0; i + j < kParts; ++j) {
        for (const double third : {1.0 / 3, 2.0 / 3}) {
          if (third < 0.5 || i + j + 1 < kParts) {
            const Vec3 q =
                t.a + (i + third) / kParts * (t.b - t.a) + (j + third) / kParts * (t.c - t.a);
            const double share =
                std::clamp(1 + (q - t.centroid).dot(t.slope), t.least_share, t.most_share);
            mean += std::pow(share, decay) * std::pow((p - q).norm(), -(decay + 3));
          }
        }
      }
    }
    sum += t.gain * std::max((p - t.a).dot(t.normal), 0.0) * mean / (kParts * kParts);
  }
  return sum;
}

struct Kind {
  int decay;
  double bumps;
  bool sloped;
};

class EmitterMultipoleTest : public ::testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, EmitterMultipoleTest,
                         ::testing::Values(Kind{6, 0.05, false}, Kind{6, 1, false},
                                           Kind{3, 0.2, false}, Kind{15, 0.1, false},
                                           Kind{6, 0.05, true}));

// In front, beside (in front of some planes only), and behind; and the bound is tight.
TEST_P(EmitterMultipoleTest, ErrsByNoMoreThanItsBound) {
  const auto [decay, bumps, sloped] = GetParam();
  const int power = decay + 3;
  Random random(17);
  int in_front = 0, useful = 0;
  for (int n = 0; n < 60; ++n) {
    std::vector<EmitterTriangle> sheet;
    std::vector<MultipoleLanes> lanes(1);
    const int used = 1 + n % MultipoleLanes::kLanes;
    for (int lane = 0; lane < used; ++lane) {
      const std::vector<EmitterTriangle> part = Sheet(random, 1 + n % 3, bumps, sloped);
      lanes[0].Set(lane, MakeMultipole(part, decay), power);
      sheet.insert(sheet.end(), part.begin(), part.end());
    }
    const Vec3 center = random.Uniform(5, 40) * random.InBox(-1, 1).normalized(),
               half = random.InBox(0.1, 1);
    const double bound = lanes[0].ErrorInBox(center, half, power);
    double most = 0;
    for (int k = 0; k < 4; ++k) {
      const Vec3 p = center + half.cwiseProduct(random.InBox(-1, 1));
      const double exact = Emission(sheet, decay, p);
      // Error of the quadratures: of the moments with linear depth, otherwise only of the one
      // above.
      const double slack = (sloped ? 1e-3 : 1e-4) * exact;
      EXPECT_NEAR(SumMultipoles(lanes, std::vector<std::int32_t>{0}, p, power), exact,
                  bound + slack)
          << n;
      most = std::max(most, exact);
    }
    in_front += center.z() > 3 ? 1 : 0;
    useful += center.z() > 3 && bound < 0.25 * most ? 1 : 0;
  }
  EXPECT_GT(in_front, 15);
  EXPECT_GT(useful, bumps < 0.5 ? in_front / 3 : 0);
}

// The bound grows towards the emitters and with the box.
TEST(EmitterMultipole, BoundsGrowTowardsTheEmitters) {
  Random random(18);
  MultipoleLanes lanes;
  lanes.Set(0, MakeMultipole(Sheet(random, 4, 0.1, false), 6), 9);
  double last = 0;
  for (const double height : {40.0, 20.0, 10.0, 7.0}) {
    const double bound = lanes.ErrorInBox({1, 2, height}, Vec3::Constant(0.5), 9);
    EXPECT_GT(bound, last);
    EXPECT_GT(lanes.ErrorInBox({1, 2, height}, Vec3::Constant(0.6), 9), bound);
    last = bound;
  }
  EXPECT_TRUE(std::isinf(lanes.ErrorInBox({0, 0, 1}, Vec3::Constant(0.5), 9)));
}

TEST(EmitterMultipole, ALaneThatWasNotSetIsNothing) {
  const std::vector<MultipoleLanes> empty(1);
  EXPECT_EQ(SumMultipoles(empty, std::vector<std::int32_t>{0}, {1, 2, 3}, 9), 0);
  EXPECT_EQ(empty[0].ErrorInBox({1, 2, 3}, Vec3::Ones(), 9), 0);
}

// On a fine mesh most emitters are far from a point, and a multipole replaces many of them.
TEST(EmitterMultipole, AFineMeshIsSummedByFewer) {
  const TriMesh sphere = testing::SphereMesh({0, 0, 0}, 60, 200);
  const std::vector<double> depth(sphere.points.size(), 8.0);
  const ImplicitSurface all(sphere, depth, {FlatEmitter{}, 0}),
      some(sphere, depth, {FlatEmitter{}, 1e-3});
  Random random(19);
  std::int64_t of_all = 0, of_some = 0;
  for (int n = 0; n < 10; ++n) {
    const Vec3 p = 68 * random.InBox(-1, 1).normalized();
    EXPECT_NEAR(some.Flattened(p, of_some), all.Flattened(p, of_all), 1e-3);
  }
  EXPECT_LT(of_some, of_all / 3);
  EXPECT_GT(of_some, 0);
}

}  // namespace
}  // namespace semblance::surfaces
