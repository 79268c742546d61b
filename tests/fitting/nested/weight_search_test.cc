// SPDX-License-Identifier: GPL-3.0-or-later
// Tests weights between tried ones, and the cost of inexact solves.
#include "fitting/nested/weight_search.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fitting/nested/nested_points.h"
#include "tests/testing/scattered_data.h"
#include "tests/testing/splines.h"

namespace semblance::fitting {
namespace {

using testing::HeadPoint;
using testing::PlainStart;
using testing::Scattered;

NestedWeight At(double weight, double score) { return {.weight = weight, .score = score}; }

TEST(WeightBetween, MinimisesTheParabolaOfLogarithms) {
  constexpr double kLeast = 3e-5, kScore = 0.7;
  const auto at = [](double weight) {
    const double away = std::log(weight / kLeast);
    return At(weight, kScore * std::exp(0.02 * away * away));
  };
  for (const double middle : {2e-5, 3e-5, 4e-5}) {
    EXPECT_NEAR(WeightBetween(at(middle / 4), at(middle), at(8 * middle)) / kLeast, 1, 1e-9);
  }
}

TEST(WeightBetween, ReturnsTheMiddleWithoutAMinimumBetween) {
  EXPECT_EQ(WeightBetween(At(1, 3), At(2, 2), At(4, 1)), 2);  // falling
  EXPECT_EQ(WeightBetween(At(1, 2), At(2, 2), At(4, 2)), 2);  // flat
  EXPECT_EQ(WeightBetween(At(1, 1), At(2, 2), At(4, 1)), 2);  // largest in the middle
  EXPECT_EQ(WeightBetween(At(1, kNaN), At(2, 2), At(4, 3)), 2);
}

class Search : public ::testing::Test {
 protected:
  static constexpr int kCount = 1500;

  Search()
      : start_(PlainStart({.patches_u = 8, .patches_v = 8, .max_level = 0})),
        points_(Displacements()),
        solve_(points_, MeanLengths(start_)),
        space_(start_.shape()) {
    space_.Link();
    solve_.Begin(space_, {.left_out = std::vector<char>(points_.size(), 0)});
  }

  NestedPoints Displacements() const {
    std::vector<Vec3> positions;
    std::vector<Vec2> uv;
    for (const FitPoint& p : Scattered(HeadPoint, kCount, 0.01, 4).points) {
      positions.push_back(p.position);
      uv.push_back(p.uv);
    }
    return DisplacementsFrom(start_, {positions, uv}, 1);
  }

  HSplineSurface start_;
  NestedPoints points_;
  NestedSolve solve_;
  NestedSpace space_;
};

TEST_F(Search, InexactSolvesFindAnEquallyGoodWeight) {
  NestedWeightSearch exact(kCount, solve_, 1e-4, 0);
  exact.Scan();
  exact.Climb(2, exact.Finish().weight);
  const double score = exact.FinalSolve(exact.Between()).score;
  NestedWeightSearch loose(kCount, solve_, 0.1, 0);
  loose.Scan();
  loose.Climb(2, loose.Finish().weight);
  EXPECT_NEAR(loose.FinalSolve(loose.Between()).score / score, 1, 0.02);
}

TEST_F(Search, FinalSolveUsesTheGivenWeight) {
  NestedWeightSearch search(kCount, solve_, 0.1, 0);
  search.Climb(4, solve_.EvenWeight());
  const double weight = 1.7 * search.Finish().weight;
  const NestedWeight settled = search.FinalSolve(weight);
  EXPECT_EQ(settled.weight, weight);
  EXPECT_EQ(search.Finish().weight, weight);
  EXPECT_GT(settled.degrees_of_freedom, 0);
}

}  // namespace
}  // namespace semblance::fitting
