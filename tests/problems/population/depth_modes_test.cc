// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/depth_modes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

constexpr int kSide = 8, kCells = kSide * kSide;

double First(int cell) { return 1 + 0.5 * std::sin(0.2 * cell); }
double Second(int cell) { return 0.3 * std::cos(0.1 * cell); }

// Depths made of two modes, with a fraction of the cells missing.
std::vector<DenseDepths> People(int count, double missing, std::vector<double>& first) {
  Random random(11);
  std::vector<DenseDepths> people;
  for (int k = 0; k < count; ++k) {
    const double a = random.Normal(), b = random.Normal();
    first.push_back(a);
    DenseDepths& person = people.emplace_back();
    person.columns = person.rows = kSide;
    for (int cell = 0; cell < kCells; ++cell) {
      const bool there = random.Uniform() >= missing;
      person.depth_mm.push_back(there ? 10 + a * First(cell) + b * Second(cell) : kNaN);
      person.bone.push_back(there ? Vec3(cell, 0, 0) : Vec3(Vec3::Constant(kNaN)));
    }
  }
  return people;
}

DenseOptions Options(int modes) {
  return {.columns = kSide, .rows = kSide, .least_share = 0.5, .modes = modes};
}

double Correlation(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const Eigen::VectorXd x = a.array() - a.mean(), y = b.array() - b.mean();
  return x.dot(y) / (x.norm() * y.norm());
}

TEST(FindModes, FindsTheModesOfTheDepths) {
  std::vector<double> first;
  const auto people = People(80, 0, first);
  const DepthModes modes = FindModes(people, Options(4));
  ASSERT_EQ(modes.modes_mm.size(), 4u);
  EXPECT_NEAR(modes.share[0] + modes.share[1], 1, 1e-9);
  EXPECT_LT(modes.share[2], 1e-9);
  const Eigen::Map<const Eigen::VectorXd> drawn(first.data(), std::ssize(first));
  EXPECT_GT(Correlation(modes.scores.col(0), drawn), 0.99);
  EXPECT_NEAR(modes.scores.col(0).squaredNorm() / 79, 1, 1e-9);
}

// Missing depths are estimated from the others, so that the modes are those of complete people.
TEST(FindModes, HardlyChangeWithAQuarterMissing) {
  std::vector<double> ignored, again;
  const DepthModes whole = FindModes(People(80, 0, ignored), Options(2));
  const DepthModes part = FindModes(People(80, 0.25, again), Options(2));
  ASSERT_EQ(part.modes_mm.size(), 2u);
  EXPECT_NEAR(part.share[0], whole.share[0], 0.1);
  for (const int cell : {3, 30, 60}) {
    ASSERT_TRUE(part.used[cell]);
    EXPECT_LT(part.n[cell], 80);
    EXPECT_NEAR(part.modes_mm[0][cell] / part.modes_mm[0][5], First(cell) / First(5), 0.1);
  }
}

TEST(FindModes, LeavesOutCellsThatFewHaveAndNeedsTwoPeople) {
  std::vector<double> ignored;
  auto people = People(10, 0, ignored);
  for (int k = 0; k < 9; ++k) {
    people[k].depth_mm[7] = kNaN;
  }
  const DepthModes modes = FindModes(people, Options(2));
  EXPECT_FALSE(modes.used[7]);
  EXPECT_EQ(modes.n[7], 1);
  EXPECT_TRUE(std::isnan(modes.sd_mm[7]));
  EXPECT_TRUE(std::isnan(modes.modes_mm[0][7]));
  people.resize(1);
  EXPECT_TRUE(FindModes(people, Options(2)).modes_mm.empty());
}

}  // namespace
}  // namespace semblance::problems
