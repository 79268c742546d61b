// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/problem/placement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"
#include "tests/testing/splines.h"

namespace semblance::fitting {
namespace {

using ::testing::HasSubstr;

std::vector<Vec3> Cloud(int n, std::uint64_t random_seed) {
  Random random(random_seed);
  std::vector<Vec3> points;
  for (int i = 0; i < n; ++i) {
    points.push_back(random.InBox(-80, 80));
  }
  return points;
}

Similarity Pose() {
  return {.scale = 1.13,
          .rotation = Eigen::AngleAxisd(2.4, Vec3(1, -2, 0.5).normalized()).toRotationMatrix(),
          .translation = Vec3(40, -7, 12)};
}

std::vector<Vec3> Moved(const Similarity& to_from, const std::vector<Vec3>& points) {
  std::vector<Vec3> moved;
  for (const Vec3& p : points) {
    moved.push_back(to_from * p);
  }
  return moved;
}

double Cost(const Similarity& s, const std::vector<Vec3>& a, const std::vector<Vec3>& b,
            const std::vector<double>& w) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += w[i] * (b[i] - s * a[i]).squaredNorm();
  }
  return sum;
}

void ExpectNear(const Similarity& a, const Similarity& b, double tolerance) {
  EXPECT_NEAR(a.scale, b.scale, tolerance);
  EXPECT_LT((a.rotation - b.rotation).norm(), tolerance);
  EXPECT_LT((a.translation - b.translation).norm(), 100 * tolerance);
}

TEST(Placement, RecoversASimilarity) {
  const std::vector<Vec3> a = Cloud(12, 1);
  ExpectNear(PlaceTemplate(a, Moved(Pose(), a)), Pose(), 1e-12);
}

TEST(Placement, ThreePointsAreEnoughToRotate) {
  const std::vector<Vec3> a = Cloud(3, 2);
  ExpectNear(PlaceTemplate(a, Moved(Pose(), a)), Pose(), 1e-12);
}

TEST(Placement, NeverReflects) {
  const std::vector<Vec3> a = Cloud(10, 3);
  std::vector<Vec3> mirrored = a;
  for (Vec3& p : mirrored) {
    p.x() = -p.x();
  }
  const Similarity s = PlaceTemplate(a, mirrored);
  EXPECT_NEAR(s.rotation.determinant(), 1, 1e-12);
  EXPECT_GT(s.scale, 0);
}

TEST(Placement, NoNearbySimilarityIsBetter) {
  const std::vector<Vec3> a = Cloud(9, 4);
  Similarity pose = Pose();
  pose.rotation = Eigen::AngleAxisd(0.4, Vec3::UnitY());
  std::vector<Vec3> b = Moved(pose, a);
  std::vector<double> w;
  Random random(5);
  for (Vec3& p : b) {
    p += random.InBox(-9, 9);
    w.push_back(random.Uniform(0.1, 3));
  }
  for (const bool rotate : {false, true}) {
    for (const bool scale : {false, true}) {
      const Similarity best = PlaceTemplate(a, b, w, {.rotate = rotate, .scale = scale});
      EXPECT_TRUE(rotate || best.rotation == Mat3::Identity());
      EXPECT_TRUE(scale || best.scale == 1);
      for (int trial = 0; trial < 50; ++trial) {
        Similarity other = best;
        other.translation += random.InBox(-1e-2, 1e-2);
        other.scale *= scale ? random.Uniform(0.999, 1.001) : 1;
        const Vec3 axis = rotate ? random.InBox(-1e-3, 1e-3) : Vec3::Zero();
        other.rotation = Eigen::AngleAxisd(axis.norm(), axis.normalized()) * other.rotation;
        EXPECT_GE(Cost(other, a, b, w), Cost(best, a, b, w) * (1 - 1e-12));
      }
    }
  }
}

TEST(Placement, WeightsActLikeRepetition) {
  const std::vector<Vec3> a = Cloud(5, 6), b = Cloud(5, 7);
  std::vector<Vec3> a2 = a, b2 = b;
  a2.push_back(a[2]);
  b2.push_back(b[2]);
  ExpectNear(PlaceTemplate(a, b, std::vector<double>{1, 1, 2, 1, 1}), PlaceTemplate(a2, b2), 1e-12);
}

TEST(Placement, TransformedSurfacesMoveAtEveryPoint) {
  for (const OffsetReference reference : {OffsetReference::kFrame, OffsetReference::kWorld}) {
    for (const Closure closure : {Closure::kOpen, Closure::kPeriodicU}) {
      const HSplineSurface surface = testing::RandomSurface(
          {.patches_u = 5, .patches_v = 4, .closure = closure, .reference = reference}, 9);
      const HSplineSurface moved = Transformed(surface, Pose());
      Random random(10);
      for (int k = 0; k < 100; ++k) {
        const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
        EXPECT_LT((moved.Point(uv) - Pose() * surface.Point(uv)).norm(), 1e-10);
      }
    }
  }
}

TEST(Placement, ErrorsNameTheRemedy) {
  const auto message = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  };
  const std::vector<Vec3> none, line = {{0, 0, 0}, {1, 2, 3}, {2, 4, 6}, {5, 10, 15}};
  const std::vector<Vec3> same(3, Vec3(1, 1, 1)), three = Cloud(3, 8), two = Cloud(2, 8);
  EXPECT_THAT(message([&] { PlaceTemplate(none, none); }), HasSubstr("no point"));
  EXPECT_THAT(message([&] { PlaceTemplate(line, line); }), HasSubstr("rotate: false"));
  EXPECT_THAT(message([&] { PlaceTemplate(two, two); }), HasSubstr("rotate: false"));
  EXPECT_THAT(message([&] { PlaceTemplate(same, three, {}, {.rotate = false}); }),
              HasSubstr("scale: false"));
  EXPECT_THAT(message([&] { PlaceTemplate(three, two); }),
              HasSubstr("3 points on the template, 2"));
  EXPECT_THAT(message([&] {
                PlaceTemplate(three, three, std::vector<double>{1, -1, 1});
              }),
              HasSubstr("weight -1 of point 1"));
  std::vector<Vec3> bad = three;
  bad[1].y() = kNaN;
  EXPECT_THAT(message([&] { PlaceTemplate(three, bad); }), HasSubstr("point 1 is not finite"));
  EXPECT_NO_THROW(PlaceTemplate(line, line, {}, {.rotate = false}));
}

}  // namespace
}  // namespace semblance::fitting
