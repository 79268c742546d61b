// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/factor_effects.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "problems/experiment/metrics/statistics.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

using ::testing::DoubleEq;
using ::testing::ElementsAre;
using ::testing::Pointwise;

// Subjects that differ widely, noise of sd 1, and the effects given per cell.
GridValues RandomGrid(std::vector<std::size_t> levels, std::size_t subjects, int random_seed,
                      const std::vector<double>& cell_effects = {}) {
  GridValues grid{.levels = std::move(levels), .subject = {}};
  Random random(static_cast<std::uint64_t>(random_seed));
  std::size_t cells = 1;
  for (const std::size_t n : grid.levels) {
    cells *= n;
  }
  for (std::size_t s = 0; s < subjects; ++s) {
    const double own = 20 * random.Normal();
    grid.subject.emplace_back();
    for (std::size_t c = 0; c < cells; ++c) {
      grid.subject.back().push_back(own + random.Normal() +
                                    (cell_effects.empty() ? 0 : cell_effects[c]));
    }
  }
  return grid;
}

// The sums of squares of a two-way table have a closed form.
TEST(FactorEffects, SharesAreThoseOfTheAnalysisOfVariance) {
  const std::size_t a = 3, b = 4, n = 5;
  const GridValues grid = RandomGrid({a, b}, n, 7, {0, 1, 2, 3, 2, 2, 2, 2, 5, 4, 1, 0});
  const auto y = [&](std::size_t s, std::size_t i, std::size_t j) {
    return grid.subject[s][i * b + j];
  };
  const auto mean = [&](auto&& keep) {
    double sum = 0, count = 0;
    for (std::size_t s = 0; s < n; ++s) {
      for (std::size_t i = 0; i < a; ++i) {
        for (std::size_t j = 0; j < b; ++j) {
          sum += keep(s, i, j) ? y(s, i, j) : 0;
          count += keep(s, i, j) ? 1 : 0;
        }
      }
    }
    return sum / count;
  };
  const double all = mean([](auto, auto, auto) { return true; });
  double ss_a = 0, ss_b = 0, ss_ab = 0, ss_within = 0;
  for (std::size_t s = 0; s < n; ++s) {
    const double own = mean([&](auto r, auto, auto) { return r == s; });
    for (std::size_t i = 0; i < a; ++i) {
      const double row = mean([&](auto, auto p, auto) { return p == i; });
      for (std::size_t j = 0; j < b; ++j) {
        const double column = mean([&](auto, auto, auto q) { return q == j; });
        const double cell = mean([&](auto, auto p, auto q) { return p == i && q == j; });
        ss_a += std::pow(row - all, 2);
        ss_b += std::pow(column - all, 2);
        ss_ab += std::pow(cell - row - column + all, 2);
        ss_within += std::pow(y(s, i, j) - own, 2);
      }
    }
  }
  EXPECT_NEAR(ComputeEffect(grid, {0}).share, ss_a / ss_within, 1e-12);
  EXPECT_NEAR(ComputeEffect(grid, {1}).share, ss_b / ss_within, 1e-12);
  EXPECT_NEAR(ComputeEffect(grid, {0, 1}).share, ss_ab / ss_within, 1e-12);
}

TEST(FactorEffects, AddedEffectsHaveNoInteraction) {
  GridValues grid{.levels = {2, 3}, .subject = {}};
  for (const double own : {0.0, 5.0, -3.0}) {
    grid.subject.push_back({own, own + 1, own + 4, own + 2, own + 3, own + 6});
  }
  const double a = ComputeEffect(grid, {0}).share, b = ComputeEffect(grid, {1}).share;
  EXPECT_NEAR(a + b, 1, 1e-12);
  EXPECT_NEAR(a, 3 * 1.0 / (3 * 1.0 + 26.0 / 3), 1e-12);  // per subject: 6 * 1^2, 2 * 26 / 3
  EXPECT_NEAR(ComputeEffect(grid, {0, 1}).share, 0, 1e-12);
}

// All orders of the levels of all subjects, those of the first one too.
double BruteForceP(const GridValues& grid) {
  const std::size_t k = grid.levels[0], n = grid.subject.size();
  std::vector<std::vector<std::size_t>> orders(1, std::vector<std::size_t>(k));
  std::iota(orders[0].begin(), orders[0].end(), 0);
  for (auto next = orders[0]; std::ranges::next_permutation(next).found;) {
    orders.push_back(next);
  }
  const auto spread = [&](const std::vector<std::size_t>& chosen) {
    double squares = 0;
    for (std::size_t i = 0; i < k; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        double difference = 0;
        for (std::size_t s = 0; s < n; ++s) {
          difference +=
              grid.subject[s][orders[chosen[s]][i]] - grid.subject[s][orders[chosen[s]][j]];
        }
        squares += difference * difference;
      }
    }
    return squares;
  };
  std::vector<std::size_t> chosen(n, 0);
  const double observed = spread(chosen);
  double extreme = 0, count = 0;
  for (bool goes_on = true; goes_on;) {
    extreme += spread(chosen) >= observed * (1 - 1e-9) ? 1 : 0;
    count += 1;
    goes_on = false;
    for (std::size_t s = 0; s < n && !goes_on; ++s) {
      chosen[s] = (chosen[s] + 1) % orders.size();
      goes_on = chosen[s] != 0;
    }
  }
  return extreme / count;
}

TEST(FactorEffects, ExactPIsTheCountOverAllOrders) {
  for (int random_seed = 1; random_seed <= 4; ++random_seed) {
    const GridValues grid = RandomGrid({3}, 5, random_seed, {0, 0.5, 1});
    const FactorEffect effect = ComputeEffect(grid, {0});
    EXPECT_TRUE(effect.exact);
    EXPECT_NEAR(effect.p, BruteForceP(grid), 1e-12) << random_seed;
  }
}

TEST(FactorEffects, DrawnPIsNearTheCountOverAllOrders) {
  for (int random_seed = 1; random_seed <= 3; ++random_seed) {
    const GridValues grid = RandomGrid({3}, 7, random_seed, {0, 0.3, 0.8});
    const FactorEffect effect = ComputeEffect(grid, {0});
    EXPECT_FALSE(effect.exact);
    const double p = BruteForceP(grid);
    EXPECT_NEAR(effect.p, p, 4 * std::sqrt(p * (1 - p) / 20000) + 1e-4) << random_seed;
  }
}

// With two levels each, the interaction is one difference of differences per subject, and its test
// the count over all signs.
// One subject shows no effect, however many orders its levels have: p = 1, at once.
TEST(FactorEffects, ASingleSubjectHasNoTest) {
  const GridValues grid = RandomGrid({40, 3}, 1, 3);
  for (const std::vector<std::size_t>& factors : {std::vector<std::size_t>{0}, {1}, {0, 1}}) {
    EXPECT_EQ(ComputeEffect(grid, factors).p, 1);
  }
}

TEST(FactorEffects, TheInteractionOfTwoByTwoIsAPairedTest) {
  const GridValues grid = RandomGrid({2, 2}, 7, 3, {0, 1, 1, 3});
  std::vector<double> contrasts;
  for (const auto& y : grid.subject) {
    contrasts.push_back(y[0] - y[1] - y[2] + y[3]);
  }
  const double observed = std::abs(std::accumulate(contrasts.begin(), contrasts.end(), 0.0));
  int extreme = 0;
  for (unsigned signs = 0; signs < 128; ++signs) {
    double sum = 0;
    for (std::size_t s = 0; s < 7; ++s) {
      sum += ((signs >> s) & 1U) != 0 ? contrasts[s] : -contrasts[s];
    }
    extreme += std::abs(sum) >= observed * (1 - 1e-9) ? 1 : 0;
  }
  EXPECT_NEAR(ComputeEffect(grid, {0, 1}).p, extreme / 128.0, 1e-12);
}

TEST(FactorEffects, TheSmallestPOfTwoLevelsIsThatOfSigns) {
  GridValues grid{.levels = {2}, .subject = {}};
  for (int s = 0; s < 6; ++s) {
    grid.subject.push_back({1.0 * s, 1.0 * s + 1 + 0.1 * s});
  }
  EXPECT_DOUBLE_EQ(ComputeEffect(grid, {0}).p, 1.0 / 32);
}

TEST(FactorEffects, SubjectsThatDifferOnlyInLevelChangeNothing) {
  GridValues grid = RandomGrid({4, 3}, 6, 11, {0, 0, 1, 0, 1, 1, 2, 0, 0, 1, 1, 1});
  const FactorEffect before = ComputeEffect(grid, {1});
  for (std::size_t s = 0; s < grid.subject.size(); ++s) {
    for (double& value : grid.subject[s]) {
      value += 64.0 * static_cast<double>(s);
    }
  }
  const FactorEffect after = ComputeEffect(grid, {1});
  EXPECT_NEAR(after.share, before.share, 1e-9);
  EXPECT_DOUBLE_EQ(after.p, before.p);
}

// Among grids without any effect 5 % have p <= 0.05, main effects and interactions alike.
TEST(FactorEffects, GridsWithoutEffectAreRarelySignificant) {
  constexpr int kGrids = 300;
  int main = 0, both = 0;
  for (int n = 0; n < kGrids; ++n) {
    const GridValues grid = RandomGrid({3, 2}, 6, 1000 + n);
    main += ComputeEffect(grid, {0}).p <= 0.05 ? 1 : 0;
    both += ComputeEffect(grid, {0, 1}).p <= 0.05 ? 1 : 0;
  }
  const double sd = std::sqrt(kGrids * 0.05 * 0.95);
  EXPECT_NEAR(main, 0.05 * kGrids, 3.5 * sd);
  EXPECT_NEAR(both, 0.05 * kGrids, 3.5 * sd);
}

// A main effect is no interaction, and an interaction no main effect.
TEST(FactorEffects, EachEffectIsFoundAlone) {
  const GridValues rows = RandomGrid({3, 2}, 8, 5, {0, 0, 3, 3, 6, 6}),
                   crossed = RandomGrid({3, 2}, 8, 5, {-3, 3, 0, 0, 3, -3});
  EXPECT_LT(ComputeEffect(rows, {0}).p, 0.001);
  EXPECT_GT(ComputeEffect(rows, {0, 1}).p, 0.05);
  EXPECT_LT(ComputeEffect(crossed, {0, 1}).p, 0.001);
  EXPECT_GT(ComputeEffect(crossed, {0}).p, 0.05);
  EXPECT_GT(ComputeEffect(crossed, {1}).p, 0.05);
}

TEST(FactorEffects, LevelMeansAverageOverTheOtherFactors) {
  const GridValues grid{.levels = {2, 3}, .subject = {{1, 2, 3, 5, 8, 11}}};
  EXPECT_THAT(LevelMeans(grid, 0, {0}), ElementsAre(DoubleEq(2), DoubleEq(8)));
  EXPECT_THAT(LevelMeans(grid, 0, {1}), ElementsAre(DoubleEq(3), DoubleEq(5), DoubleEq(7)));
  EXPECT_THAT(LevelMeans(grid, 0, {0, 1}), Pointwise(DoubleEq(), grid.subject[0]));
}

// Two columns: the removed rows keep the columns' means, and their difference has the sd of the
// paired differences.
TEST(FactorEffects, RemovedSubjectMeansLeaveThePairedSpread) {
  const std::vector<std::vector<double>> rows = {{1, 2}, {11, 13}, {21, 24}, {4, 4}};
  const auto removed = RemoveSubjectMeans(rows);
  std::vector<double> first, second, differences;
  for (std::size_t s = 0; s < rows.size(); ++s) {
    first.push_back(removed[s][0]);
    second.push_back(removed[s][1]);
    differences.push_back(rows[s][1] - rows[s][0]);
  }
  EXPECT_NEAR(Summarize(first).mean, 9.25, 1e-12);
  EXPECT_NEAR(Summarize(second).mean, 10.75, 1e-12);
  // Both columns have the variance of the differences / 2, as two independent columns would.
  EXPECT_NEAR(Summarize(first).sd, Summarize(differences).sd / std::sqrt(2), 1e-12);
  EXPECT_NEAR(Summarize(second).sd, Summarize(differences).sd / std::sqrt(2), 1e-12);
}

TEST(FactorEffects, AnIncompleteGridIsRefused) {
  EXPECT_THROW(ComputeEffect({.levels = {2}, .subject = {{1, NAN}}}, {0}), InputError);
  EXPECT_THROW(ComputeEffect({.levels = {2, 2}, .subject = {{1, 2, 3}}}, {0}), InputError);
  EXPECT_THROW(ComputeEffect({.levels = {1}, .subject = {{1}}}, {0}), InputError);
  EXPECT_THROW(ComputeEffect({.levels = {2}, .subject = {}}, {0}), InputError);
}

}  // namespace
}  // namespace semblance::problems
