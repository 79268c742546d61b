// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/sphere.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "fitting/parameters/around_axis.h"
#include "surfaces/base/random.h"

namespace semblance {
namespace {

const Vec3 kCentre(100, -20, 7);
const Vec3 kAxis = Vec3(1, 2, -0.5).normalized();

Vec3 Direction(Random& random) {
  return Vec3(random.Normal(), random.Normal(), random.Normal()).normalized();
}

// Azimuths and angles from the pole at -kAxis over pi, and where they are on a sphere of radius 30.
struct Made {
  std::vector<Vec2> uv;
  std::vector<Vec3> points;
};

Made MakeSphere(int count) {
  const auto [a, b] = Across(kAxis);
  Random random(7);
  Made made;
  for (int k = 0; k < count; ++k) {
    const Vec2 uv(random.Uniform(), random.Uniform());
    const double turn = 2 * std::numbers::pi * uv.x(), angle = std::numbers::pi * uv.y();
    made.uv.push_back(uv);
    made.points.push_back(kCentre +
                          30 * (std::sin(angle) * (std::cos(turn) * a + std::sin(turn) * b) -
                                std::cos(angle) * kAxis));
  }
  return made;
}

TEST(Sphere, AnglesOfItsPointsAreThoseTheyWereMadeWith) {
  const Made made = MakeSphere(300);
  const PolarSphere sphere = SphereThrough(made.points, 5 * kAxis);
  EXPECT_LT((sphere.centre - kCentre).norm(), 1e-10);
  EXPECT_NEAR(sphere.radius_mm, 30, 1e-10);
  EXPECT_LT((sphere.axis - kAxis).norm(), 1e-14);
  const std::vector<Vec2> uv = AnglesAbout(sphere, made.points);
  for (std::size_t k = 0; k < uv.size(); ++k) {
    EXPECT_LT((uv[k] - made.uv[k]).norm(), 1e-10);
  }
}

TEST(Sphere, ItsPolesAreFoundAmongOutliers) {
  Made made = MakeSphere(4000);
  for (std::size_t k = 0; k < made.points.size(); k += 10) {
    made.points[k] = kCentre + 1.3 * (made.points[k] - kCentre);
  }
  const PolarSphere sphere{.centre = kCentre, .axis = kAxis, .radius_mm = 30};
  const Poles poles = PolesOf(sphere, made.points, AnglesAbout(sphere, made.points));
  EXPECT_LT((poles[0] - (kCentre - 30 * kAxis)).norm(), 1e-6);
  EXPECT_LT((poles[1] - (kCentre + 30 * kAxis)).norm(), 1e-6);
}

// Distances that wave about the pole; with noise the pole is surer than any point.
TEST(Sphere, PolesOfWhatIsNoSphereAreItsOwn) {
  const auto distance = [](const Vec3& d) { return 30 + 4 * std::sin(3 * d.x() + 1) + d.y(); };
  const PolarSphere sphere{.centre = kCentre, .axis = kAxis, .radius_mm = 30};
  for (const double noise : {0.0, 0.1}) {
    Random random(5);
    std::vector<Vec3> points;
    for (int k = 0; k < 20000; ++k) {
      const Vec3 d = Direction(random);
      points.push_back(kCentre + (distance(d) + noise * random.Normal()) * d);
    }
    const Poles poles = PolesOf(sphere, points, AnglesAbout(sphere, points));
    for (const int pole : {0, 1}) {
      const Vec3 d = (pole == 0 ? -1 : 1) * kAxis;
      EXPECT_LT((poles[pole] - (kCentre + distance(d) * d)).norm(), 0.005 + noise);
    }
  }
}

// Coordinates of any surface over the angles, outliers apart.
TEST(Sphere, PolesOfAnySurfaceAreWhereItsPointsLead) {
  const auto place = [](const Vec2& uv) -> Vec3 {
    const double t = std::numbers::pi * uv.y(), a = 2 * std::numbers::pi * uv.x();
    const Vec2 from = std::sin(t) * Vec2(std::cos(a), std::sin(a));
    return {5 * from.x() + std::cos(t), from.y() - 2 * from.x() * from.y(), 0};
  };
  Random random(5);
  std::vector<Vec2> uv;
  std::vector<Vec3> points;
  for (int k = 0; k < 20000; ++k) {
    const Vec3 d = Direction(random);
    uv.emplace_back(Turns(d.y(), d.x()), std::acos(d.z()) / std::numbers::pi);
    points.push_back(place(uv.back()));
    if (k % 10 == 0) {
      points.back() += Vec3(0, 3, 1);
    }
  }
  const Poles poles = PolesAmong(points, uv);
  EXPECT_LT((poles[0] - Vec3(1, 0, 0)).norm(), 1e-4);
  EXPECT_LT((poles[1] - Vec3(-1, 0, 0)).norm(), 1e-4);
}

TEST(Sphere, TheWidestRayIsWhereNothingIs) {
  const PolarSphere sphere{.centre = kCentre, .axis = kAxis, .radius_mm = 30};
  Random random(3);
  std::vector<Vec3> ball, capless, tube;
  for (int k = 0; k < 20000; ++k) {
    const Vec3 d = Direction(random);
    ball.push_back(kCentre + 30 * d);
    if (d.dot(kAxis) < std::cos(std::numbers::pi / 3)) {
      capless.push_back(kCentre + 30 * d);
    }
    const Vec3 across = (d - d.dot(kAxis) * kAxis).normalized();
    tube.push_back(kCentre + 10 * across + random.Uniform(-40, 40) * kAxis);
  }
  const std::vector<Vec3> axes = {kAxis};
  EXPECT_LT(WidestRay(sphere, ball, axes).Width(), 0.1);
  EXPECT_NEAR(WidestRay(sphere, tube, axes).Width(), 1, 1e-3);
  const EmptyRay ray = WidestRay(sphere, capless, axes);
  EXPECT_GT(ray.Width(), 0.9);
  EXPECT_GT(ray.direction.dot(kAxis), 0.95);
}

}  // namespace
}  // namespace semblance
