// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/torus.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "surfaces/base/random.h"

namespace semblance {
namespace {

// A ring of radius 30 with a tube of 9, turned, off the origin.
struct Made {
  std::vector<Vec3> points;
  std::vector<Vec2> turns;
  Vec3 axis;
};

const Vec3 kCentre(100, -20, 7);

Made MakeTorus(int count, double noise, double outliers = 0) {
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  Random random(7);
  Made made{.points = {}, .turns = {}, .axis = turn.col(2)};
  for (int k = 0; k < count; ++k) {
    const Vec2 turns(random.Uniform(), random.Uniform()), angle = 2 * std::numbers::pi * turns;
    const double distance = 30 + 9 * std::cos(angle.y());
    const Vec3 off(random.Normal(), random.Normal(), random.Normal());
    made.turns.push_back(turns);
    made.points.push_back(kCentre + noise * off +
                          turn * Vec3(distance * std::cos(angle.x()),
                                      distance * std::sin(angle.x()), 9 * std::sin(angle.y())));
    if (random.Uniform() < outliers) {
      made.points.back() += random.InBox(-60, 60);
    }
  }
  return made;
}

TEST(Torus, IsFoundWithoutNoiseToTheDigit) {
  const Made made = MakeTorus(500, 0);
  const Torus torus = TorusThrough(made.points, Vec3::Zero());
  EXPECT_LT((torus.centre - kCentre).norm(), 1e-7);
  EXPECT_NEAR(std::abs(torus.axis.dot(made.axis)), 1, 1e-12);
  EXPECT_NEAR(torus.ring_mm, 30, 1e-7);
  EXPECT_NEAR(torus.tube_mm, 9, 1e-7);
  EXPECT_LT(torus.median_off_mm, 1e-7);
}

TEST(Torus, IsFoundAmongNoiseAndOutliers) {
  for (const double outliers : {0.0, 0.15}) {
    const Made made = MakeTorus(20000, 0.5, outliers);
    const Torus torus = TorusThrough(made.points, Vec3::Zero());
    EXPECT_LT((torus.centre - kCentre).norm(), 0.3);
    EXPECT_GT(std::abs(torus.axis.dot(made.axis)), 1 - 1e-4);
    EXPECT_NEAR(torus.ring_mm, 30, 0.3);
    EXPECT_NEAR(torus.tube_mm, 9, 0.09);
  }
}

TEST(Torus, AnAxisThatIsGivenStays) {
  const Made made = MakeTorus(3000, 0.1);
  const Vec3 asked = 5 * (made.axis + Vec3(0.05, 0, 0.02));
  const Torus torus = TorusThrough(made.points, asked);
  EXPECT_LT((torus.axis - asked.normalized()).norm(), 1e-12);
  EXPECT_NEAR(torus.ring_mm, 30, 0.5);
}

// Those that the points were made with, but for where they start and the sense of the axis.
TEST(Torus, TurnsAreTheAngles) {
  const Made made = MakeTorus(500, 0);
  const Torus torus = TorusThrough(made.points, Vec3::Zero());
  const std::vector<Vec2> turns = TurnsAround(torus, made.points);
  const double sense = torus.axis.dot(made.axis) > 0 ? 1 : -1;
  const auto off = [](double x) { return std::abs(x - std::round(x)); };
  for (std::size_t k = 0; k < turns.size(); ++k) {
    EXPECT_GE(turns[k].minCoeff(), 0);
    EXPECT_LE(turns[k].maxCoeff(), 1);
    EXPECT_LT(off(turns[k].y() - sense * made.turns[k].y()), 1e-8);
    EXPECT_LT(off(turns[k].x() - turns[0].x() - sense * (made.turns[k].x() - made.turns[0].x())),
              1e-8);
  }
}

}  // namespace
}  // namespace semblance
