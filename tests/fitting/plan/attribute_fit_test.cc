// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/plan/attribute_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "fitting/fit.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/scattered_data.h"

namespace semblance::fitting {
namespace {

struct Coloured {
  std::vector<Vec2> uv;
  std::vector<std::vector<double>> values;
  HSplineSurface surface;

  AttributeColumns Columns() const {
    return {.uv = uv, .weights = {}, .columns = {values.begin(), values.end()}};
  }
};

double Wave(const Vec2& uv) {
  return 100 + 20 * std::sin(2 * std::numbers::pi * uv.x()) * std::cos(4 * uv.y());
}

// The head, refined where it has detail, with the given number of columns: a constant, a wave with
// noise, a wave, and so on.
Coloured ColouredHead(int columns, double noise) {
  const FitTarget target = testing::Scattered(testing::HeadPoint, 8000, 1e-4, 3);
  const HSplineShape shape{.max_level = 3, .closure = Closure::kPeriodicU};
  Coloured head{.uv = {},
                .values = std::vector<std::vector<double>>(columns),
                .surface = Fit(testing::PlainStart(shape), target, {},
                               {.plan = AdaptivePlan{.tolerance_mm = 4e-3, .finest = 3},
                                .terms = {PointTerm{}, SmoothnessTerm{.weight = 1e-9}},
                                .solver = Solver::kFastest},
                               {})
                               .surface};
  Random random(5);
  for (const FitPoint& p : target.points) {
    head.uv.push_back(p.uv);
    for (int c = 0; c < columns; ++c) {
      head.values[c].push_back(c == 0 ? 7.5 : Wave(p.uv) + (c == 1 ? noise * random.Normal() : 0));
    }
  }
  return head;
}

TEST(AttributeFit, AnyNumberOfColumnsIsRecovered) {
  const Coloured head = ColouredHead(5, 3);
  const AttributeFit fit = FitAttributes(head.surface, head.Columns(), {}, {}, {});
  ASSERT_EQ(fit.columns.size(), 5u);
  ASSERT_EQ(fit.surfaces.size(), 5u);
  std::vector<Vec2> uv;
  Random random(9);
  for (int k = 0; k < 500; ++k) {
    uv.emplace_back(random.Uniform(), random.Uniform());
  }
  const auto values = fit.At(uv, 1);
  double squares = 0;
  for (std::size_t k = 0; k < uv.size(); ++k) {
    EXPECT_NEAR(values[0][k], 7.5, 1e-6);
    for (const int exact : {2, 3, 4}) {
      EXPECT_NEAR(values[exact][k], Wave(uv[k]), 0.05);
    }
    squares += (values[1][k] - Wave(uv[k])) * (values[1][k] - Wave(uv[k]));
  }
  EXPECT_LT(std::sqrt(squares / 500), 0.6);  // most of the noise of 3 is averaged out
  EXPECT_NEAR(fit.columns[1].rms, 3, 0.15);
  EXPECT_GT(fit.columns[1].weight, fit.columns[2].weight);  // each has its own smoothness
}

// A checkerboard of +-100 with noise of 1, over a smooth head. The surface's own vertices leave an
// error of half of its height.
TEST(AttributeFit, AColumnGetsTheVerticesThatItNeeds) {
  Coloured head = ColouredHead(2, 0);
  Random random(6);
  const auto board = [](const Vec2& uv) {
    return static_cast<int>(12 * uv.x()) % 2 == static_cast<int>(8 * uv.y()) % 2 ? 100.0 : -100.0;
  };
  for (std::size_t k = 0; k < head.uv.size(); ++k) {
    head.values[1][k] = board(head.uv[k]) + random.Normal();
  }
  const AttributeFit fit = FitAttributes(head.surface, head.Columns(), {}, {}, {});
  EXPECT_EQ(fit.surfaces[1].shape().closure, Closure::kPeriodicU);
  EXPECT_TRUE(fit.surfaces[0].Offsets().empty());  // the constant needs none
  EXPECT_GT(fit.columns[1].vertices, 1000);
  double squares = 0;
  const auto values = fit.At(head.uv, 1);
  for (std::size_t k = 0; k < head.uv.size(); ++k) {
    squares += std::pow(values[1][k] - board(head.uv[k]), 2);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(head.uv.size())), 30);
}

// The fit is linear in the columns at the same weight; a change of unit and an offset choose the
// same weight.
TEST(AttributeFit, TheUnitOfAColumnDoesNotMatter) {
  Coloured head = ColouredHead(2, 3);
  const AttributeFit before = FitAttributes(head.surface, head.Columns(), {}, {}, {});
  for (double& value : head.values[1]) {
    value = 1e-3 * value - 40;
  }
  const AttributeFit after = FitAttributes(head.surface, head.Columns(), {}, {}, {});
  EXPECT_NEAR(after.columns[1].weight / before.columns[1].weight, 1, 1e-9);
  const auto a = before.At(head.uv, 1), b = after.At(head.uv, 1);
  for (std::size_t k = 0; k < head.uv.size(); k += 37) {
    EXPECT_NEAR(b[1][k], 1e-3 * a[1][k] - 40, 1e-9);
  }
}

TEST(AttributeFit, PointsThatAreLeftOutDoNotCount) {
  Coloured head = ColouredHead(3, 0);
  std::vector<std::uint32_t> wild;
  for (std::uint32_t k = 0; k < head.uv.size(); k += 20) {
    wild.push_back(k);
    head.values[2][k] = 1e6;
  }
  const AttributeFit fit = FitAttributes(head.surface, head.Columns(), wild, {}, {});
  EXPECT_LT(fit.columns[2].rms, 0.05);
}

TEST(AttributeFit, FewPointsAreRefused) {
  Coloured head = ColouredHead(2, 0);
  head.uv.resize(15);
  for (std::vector<double>& column : head.values) {
    column.resize(15);
  }
  EXPECT_THROW(FitAttributes(head.surface, head.Columns(), {}, {}, {}), InputError);
}

TEST(AttributeFit, WrongColumnsAreRefused) {
  Coloured head = ColouredHead(2, 0);
  head.values[1].pop_back();
  EXPECT_THROW(FitAttributes(head.surface, head.Columns(), {}, {}, {}), InputError);
  head.values[1].push_back(kNaN);
  EXPECT_THROW(FitAttributes(head.surface, head.Columns(), {}, {}, {}), InputError);
}

}  // namespace
}  // namespace semblance::fitting
