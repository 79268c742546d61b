// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/thin_plate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <string>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance::surfaces {
namespace {

using ::testing::HasSubstr;

// Points within 100 mm of (300, -200, 50), like those of a scan, and their targets.
struct Pairs {
  std::vector<Vec3> from, to;
  std::vector<double> weights;
};

Pairs DrawnPairs(int count, double move_mm) {
  Random random(7);
  Pairs pairs;
  for (int i = 0; i < count; ++i) {
    pairs.from.push_back(Vec3(300, -200, 50) + random.InBox(-100, 100));
    pairs.to.push_back(pairs.from.back() + random.InBox(-move_mm, move_mm));
    pairs.weights.push_back(random.Uniform(0.2, 3));
  }
  return pairs;
}

double Largest(const ThinPlate& plate, const Pairs& pairs) {
  double largest = 0;
  for (std::size_t i = 0; i < pairs.from.size(); ++i) {
    largest = std::max(largest, (plate(pairs.from[i]) - pairs.to[i]).norm());
  }
  return largest;
}

// The cost that FitThinPlate minimises.
double Cost(const ThinPlate& plate, const Pairs& pairs, double stiffness_mm) {
  double misfit = 0, bending = 0;
  for (std::size_t i = 0; i < pairs.from.size(); ++i) {
    misfit += pairs.weights[i] * (plate(pairs.from[i]) - pairs.to[i]).squaredNorm();
    for (std::size_t j = 0; j < pairs.from.size(); ++j) {
      bending -=
          plate.weights[i].dot(plate.weights[j]) * (plate.centers[i] - plate.centers[j]).norm();
    }
  }
  return misfit + stiffness_mm * 8 * std::numbers::pi * bending;
}

std::string FaultOf(const Pairs& pairs, double stiffness_mm = 0) {
  try {
    FitThinPlate(pairs.from, pairs.to, pairs.weights, {.stiffness_mm = stiffness_mm});
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ThinPlate, WithoutStiffnessEveryPointIsMet) {
  const Pairs pairs = DrawnPairs(60, 15);
  EXPECT_LT(Largest(FitThinPlate(pairs.from, pairs.to), pairs), 1e-9);
  EXPECT_LT(Largest(FitThinPlate(pairs.from, pairs.to, pairs.weights), pairs), 1e-9);
}

TEST(ThinPlate, AnAffineMapIsReproducedWhateverTheStiffness) {
  Pairs pairs = DrawnPairs(20, 0);
  Mat3 linear;
  linear << 1.1, 0.2, -0.1, 0.05, 0.9, 0.3, -0.2, 0.1, 1.2;
  const auto map = [&](const Vec3& p) { return Vec3(linear * p + Vec3(-40, 5, 900)); };
  for (std::size_t i = 0; i < pairs.from.size(); ++i) {
    pairs.to[i] = map(pairs.from[i]);
  }
  for (const double stiffness_mm : {0.0, 1.0, 1e4}) {
    const ThinPlate plate =
        FitThinPlate(pairs.from, pairs.to, pairs.weights, {.stiffness_mm = stiffness_mm});
    EXPECT_LT((plate(Vec3(1, 2, 3)) - map(Vec3(1, 2, 3))).norm(), 1e-8) << stiffness_mm;
  }
}

TEST(ThinPlate, WeightsAreOrthogonalToAffineFunctionsSoThatTheMapIsTameFarAway) {
  const Pairs pairs = DrawnPairs(30, 10);
  const ThinPlate plate = FitThinPlate(pairs.from, pairs.to, pairs.weights, {.stiffness_mm = 5});
  Vec3 sum = Vec3::Zero();
  Mat3 moment = Mat3::Zero();
  for (std::size_t i = 0; i < plate.centers.size(); ++i) {
    sum += plate.weights[i];
    moment += plate.weights[i] * plate.centers[i].transpose();
  }
  EXPECT_LT(sum.norm(), 1e-12);
  EXPECT_LT(moment.norm(), 1e-9);
}

TEST(ThinPlate, NoOtherPlateOnTheSameCentersCostsLess) {
  const Pairs pairs = DrawnPairs(12, 10);
  const double stiffness_mm = 3;
  const ThinPlate best =
      FitThinPlate(pairs.from, pairs.to, pairs.weights, {.stiffness_mm = stiffness_mm});
  const double least = Cost(best, pairs, stiffness_mm);
  Random random(11);
  for (int trial = 0; trial < 20; ++trial) {
    // adding the difference of two plates gives another valid plate
    Pairs moved = pairs;
    for (Vec3& p : moved.to) {
      p += random.InBox(-1, 1);
    }
    const ThinPlate step = FitThinPlate(moved.from, moved.to, moved.weights);
    ThinPlate other = best;
    const double length = random.Uniform(-1, 1);
    for (std::size_t i = 0; i < other.weights.size(); ++i) {
      other.weights[i] += length * step.weights[i];
    }
    other.affine += length * step.affine;
    EXPECT_GT(Cost(other, pairs, stiffness_mm), least);
  }
}

TEST(ThinPlate, StiffnessLeadsFromThePointsToTheAffineFitOfThem) {
  const Pairs pairs = DrawnPairs(40, 10);
  double last = 0;
  for (const double stiffness_mm : {0.1, 1.0, 10.0, 100.0, 1e3}) {
    const ThinPlate plate =
        FitThinPlate(pairs.from, pairs.to, pairs.weights, {.stiffness_mm = stiffness_mm});
    const double misfit = Cost(plate, pairs, 0);
    EXPECT_GT(misfit, last) << stiffness_mm;
    last = misfit;
  }
  const ThinPlate flat = FitThinPlate(pairs.from, pairs.to, pairs.weights, {.stiffness_mm = 1e12});
  for (const Vec3& weight : flat.weights) {
    EXPECT_LT(weight.norm(), 1e-9);
  }
}

TEST(ThinPlate, UnsolvableInputIsReportedInOneLine) {
  Pairs pairs = DrawnPairs(3, 1);
  EXPECT_THAT(FaultOf({}), HasSubstr("fewer than four"));
  EXPECT_THAT(FaultOf(pairs), HasSubstr("fewer than four"));
  Pairs plane = DrawnPairs(9, 1);
  for (Vec3& p : plane.from) {
    p.z() = 0.5 * p.x() - p.y();
  }
  EXPECT_THAT(FaultOf(plane, 5), HasSubstr("lie in a plane"));
  Pairs twice = DrawnPairs(9, 1);
  twice.from[4] = twice.from[2];
  EXPECT_THAT(FaultOf(twice), HasSubstr("coincide"));
  EXPECT_EQ(FaultOf(twice, 1), "accepted");
  pairs = DrawnPairs(9, 1);
  pairs.weights[3] = 0;
  EXPECT_THAT(FaultOf(pairs), HasSubstr("weight 0 of point 3"));
  pairs = DrawnPairs(9, 1);
  pairs.to[5].x() = kNaN;
  EXPECT_THAT(FaultOf(pairs), HasSubstr("point 5 is not finite"));
  pairs = DrawnPairs(9, 1);
  pairs.to.pop_back();
  EXPECT_THAT(FaultOf(pairs), HasSubstr("9 points, 8 to carry them to"));
  EXPECT_THAT(FaultOf(DrawnPairs(9, 1), -1), HasSubstr("stiffness_mm is -1"));
}

}  // namespace
}  // namespace semblance::surfaces
