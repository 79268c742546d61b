// SPDX-License-Identifier: GPL-3.0-or-later
// What every method must do, on costs in closed form.
#include "problems/search/searcher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

namespace semblance {
namespace {

// Of a point, in a run of so much of the whole length.
using CostOfPoint = std::function<double(const SearchPoint&, double length)>;

const SearchSpace kBox3 = {
    {.low = -5, .high = 10}, {.low = -5, .high = 10}, {.low = -5, .high = 10}};
double Sphere(const SearchPoint& x) {
  double sum = 0;
  for (const double value : x) {
    sum += std::pow(value - 1.3, 2);
  }
  return sum;
}

// Branin's function (Dixon & Szegoe 1978); least 0.397887.
const SearchSpace kBraninBox = {{.low = -5, .high = 10}, {.low = 0, .high = 15}};
double Branin(const SearchPoint& x) {
  const double b = 5.1 / (4 * M_PI * M_PI), c = 5 / M_PI, t = 1 / (8 * M_PI);
  return std::pow(x[1] - b * x[0] * x[0] + c * x[0] - 6, 2) + 10 * (1 - t) * std::cos(x[0]) + 10;
}

// A short run is off by more than a long one.
CostOfPoint WithShortRuns(double (*cost)(const SearchPoint&), double off) {
  return [=](const SearchPoint& x, double length) {
    return cost(x) + off * (1 - length) * std::sin(7 * x[0] + 3 * x[1]);
  };
}

const std::vector<SearchMethod> kMethods = {BayesSearch{}, CmaEsSearch{}, HalvingSearch{},
                                            RandomSearch{}};

struct SearchTrace {
  std::vector<std::vector<SearchAsk>> asks;  // by generation
  std::vector<std::vector<double>> costs;
  double spent = 0;
  double best = std::numeric_limits<double>::infinity();  // of runs in full
};

SearchTrace Search(const SearchMethod& method, const SearchSpace& space, const SearchBudget& budget,
                   const CostOfPoint& cost) {
  const std::vector<double> lengths = Searcher::CostsOfRungs(method);
  Searcher searcher(method, space, budget);
  SearchTrace trace;
  for (auto asks = searcher.Ask(); !asks.empty(); asks = searcher.Ask()) {
    std::vector<double> costs;
    for (const SearchAsk& ask : asks) {
      const double length = lengths.at(static_cast<std::size_t>(ask.rung));
      trace.spent += length;
      costs.push_back(cost(ask.point, length));
      if (length == 1) {
        trace.best = std::min(trace.best, costs.back());
      }
    }
    searcher.Tell(costs);
    trace.asks.push_back(asks);
    trace.costs.push_back(costs);
  }
  return trace;
}

double MedianBest(const SearchMethod& method, const SearchSpace& space, int budget,
                  const CostOfPoint& cost) {
  std::vector<double> best;
  for (std::uint64_t seed = 1; seed <= 7; ++seed) {
    best.push_back(Search(method, space, {budget, seed}, cost).best);
  }
  std::ranges::sort(best);
  return best[3];
}

TEST(Searcher, BeatsRandomSearchOfTheSameBudgetInTheMedian) {
  const CostOfPoint sphere = WithShortRuns(Sphere, 2), branin = WithShortRuns(Branin, 2);
  const double random_sphere = MedianBest(RandomSearch{}, kBox3, 24, sphere);
  const double random_branin = MedianBest(RandomSearch{}, kBraninBox, 24, branin);
  EXPECT_LT(MedianBest(BayesSearch{}, kBox3, 24, sphere), 0.2 * random_sphere);
  EXPECT_LT(MedianBest(BayesSearch{}, kBraninBox, 24, branin), 0.5 * random_branin);
  EXPECT_LT(MedianBest(HalvingSearch{}, kBox3, 24, sphere), random_sphere);
  EXPECT_LT(MedianBest(HalvingSearch{}, kBraninBox, 24, branin), random_branin);
  EXPECT_LT(MedianBest(CmaEsSearch{}, kBox3, 100, sphere),
            0.1 * MedianBest(RandomSearch{}, kBox3, 100, sphere));
  EXPECT_LT(MedianBest(CmaEsSearch{}, kBraninBox, 100, branin),
            MedianBest(RandomSearch{}, kBraninBox, 100, branin));
}

// The published method reaches the minimum of a sphere to rounding, given time.
TEST(Searcher, CmaEsConverges) {
  const auto cost = [](const SearchPoint& x, double) { return Sphere(x); };
  EXPECT_LT(Search(CmaEsSearch{}, kBox3, {1500, 1}, cost).best, 1e-10);
  const auto ridge = [](const SearchPoint& x, double) {  // 1 : 1000, aslant
    return std::pow(x[0] - x[1], 2) * 1e3 + std::pow(x[0] + x[1] - 5, 2) + std::pow(x[2], 2);
  };
  EXPECT_LT(Search(CmaEsSearch{}, kBox3, {3000, 1}, ridge).best, 1e-8);
}

TEST(Searcher, StoppedAnywhereItGoesOnAsIfItHadNotBeen) {
  const SearchSpace space = {
      {.low = 0, .high = 1}, {.low = 1, .high = 9, .whole = true}, {.choices = 3}};
  const auto cost = [](const SearchPoint& x, double length) {
    return x[0] + std::abs(x[1] - 4) + (x[2] == 1 ? 0 : 1) + (1 - length) * std::sin(9 * x[0]);
  };
  for (const SearchMethod& method : kMethods) {
    const SearchTrace whole = Search(method, space, {20, 3}, cost);
    for (std::size_t stop = 0; stop <= whole.asks.size(); ++stop) {
      Searcher again(method, space, {20, 3});
      for (std::size_t generation = 0; generation <= stop; ++generation) {
        const std::vector<SearchAsk> asks = again.Ask();
        if (generation == whole.asks.size()) {
          EXPECT_TRUE(asks.empty());
          break;
        }
        ASSERT_EQ(asks.size(), whole.asks[generation].size());
        for (std::size_t n = 0; n < asks.size(); ++n) {
          EXPECT_EQ(asks[n].point, whole.asks[generation][n].point);
          EXPECT_EQ(asks[n].rung, whole.asks[generation][n].rung);
        }
        again.Tell(whole.costs[generation]);
      }
    }
    if (!std::holds_alternative<RandomSearch>(method)) {  // another seed is another search
      EXPECT_NE(Search(method, space, {20, 4}, cost).asks[0][0].point, whole.asks[0][0].point);
    }
  }
}

TEST(Searcher, StaysWithinBudgetAndAxesWhateverItIsTold) {
  const SearchSpace space = {
      {.low = 2, .high = 3}, {.low = 1, .high = 1000, .whole = true, .log = true}, {.choices = 4}};
  const auto nothing = [](const SearchPoint&, double) { return std::nan(""); };
  const auto half = [](const SearchPoint& x, double) { return x[0] < 2.5 ? std::nan("") : x[0]; };
  for (const SearchMethod& method : kMethods) {
    for (const int budget : {1, 2, 7, 30}) {
      for (const CostOfPoint& cost : {CostOfPoint(nothing), CostOfPoint(half)}) {
        const SearchTrace trace = Search(method, space, {budget, 1}, cost);
        EXPECT_LE(trace.spent, budget + 1e-9);
        EXPECT_GT(trace.spent, budget - 1.0);
        for (const auto& generation : trace.asks) {
          for (const SearchAsk& ask : generation) {
            EXPECT_TRUE(ask.point[0] >= 2 && ask.point[0] <= 3) << ask.point[0];
            EXPECT_TRUE(ask.point[1] >= 1 && ask.point[1] <= 1000 &&
                        ask.point[1] == std::round(ask.point[1]));
            EXPECT_TRUE(ask.point[2] >= 0 && ask.point[2] <= 3 &&
                        ask.point[2] == std::round(ask.point[2]));
          }
        }
      }
    }
  }
}

TEST(Searcher, BayesAsksForNoPointTwiceWhileOthersAreLeftAndFindsTheChoice) {
  const SearchSpace space = {{.low = 1, .high = 4, .whole = true}, {.choices = 4}};
  const auto cost = [](const SearchPoint& x, double) {
    return std::abs(x[0] - 3) + (x[1] == 2 ? 0 : 2);
  };
  const SearchTrace trace = Search(BayesSearch{}, space, {16, 1}, cost);
  std::set<SearchPoint> points;
  int first = 0, n = 0;
  for (const auto& generation : trace.asks) {
    for (const SearchAsk& ask : generation) {
      ++n;
      points.insert(ask.point);
      first = first == 0 && ask.point == SearchPoint{3, 2} ? n : first;
    }
  }
  EXPECT_GE(points.size(), 15u);  // the first six are a hypercube's, of which two may be alike
  EXPECT_GT(first, 0);
  EXPECT_LE(first, 12);
}

// Li et al. 2018: with three rungs and eta 3, brackets of 9, 5 and 3, a third of which go on.
TEST(Searcher, HalvingKeepsTheBestThirdOfEachRung) {
  const auto cost = [](const SearchPoint& x, double) { return x[0]; };
  const SearchSpace space = {{.low = 0, .high = 1}};
  const SearchTrace trace = Search(HalvingSearch{}, space, {9, 1}, cost);
  std::vector<std::pair<int, std::size_t>> shape;
  for (const auto& generation : trace.asks) {
    shape.emplace_back(generation[0].rung, generation.size());
  }
  const std::vector<std::pair<int, std::size_t>> published = {{0, 9}, {1, 3}, {2, 1},
                                                              {1, 5}, {2, 1}, {2, 3}};
  EXPECT_EQ(shape, published);
  std::vector<double> first = trace.costs[0];
  std::ranges::sort(first);
  first.resize(3);
  EXPECT_EQ(trace.costs[1], first);
}

}  // namespace
}  // namespace semblance
