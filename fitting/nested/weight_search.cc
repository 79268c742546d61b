// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/weight_search.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "fitting/least_squares/cross_validation.h"

namespace semblance {
namespace {

// Times the weight at which points and energy balance: no more than a plane is left.
constexpr double kSmoothest = 100;
constexpr double kMostStretch = 16;

}  // namespace

double WeightBetween(const NestedWeight& rougher, const NestedWeight& middle,
                     const NestedWeight& smoother) {
  const double down = std::log(rougher.weight / middle.weight),
               up = std::log(smoother.weight / middle.weight),
               fall = std::log(rougher.score / middle.score) / down,
               rise = std::log(smoother.score / middle.score) / up,
               curvature = (rise - fall) / (up - down),
               move = (curvature * up - rise) / (2 * curvature);
  return curvature > 0 && down < move && move < up ? middle.weight * std::exp(move) : middle.weight;
}

// Of two that predict alike the smoother one, so that rounding chooses nothing.
bool NestedWeightSearch::IsBetter(const NestedWeight& next) const {
  constexpr double kAlike = 1e-5;
  const double smoother = next.weight > best_.weight ? kAlike : -kAlike;
  return std::isnan(best_.score) ? !std::isnan(next.score)
                                 : next.score < (1 + smoother) * best_.score;
}

NestedWeight NestedWeightSearch::Try(double weight) {
  const auto [at, added] = tried_.try_emplace(weight);
  if (!added) {
    return at->second;
  }
  solve_.SetWeight(weight);
  steps_ += solve_.Solve(least_gain_);
  const double mean_square = std::max(solve_.MeanSquare(), 0.0);  // less is rounding
  const double trace = solve_.Trace();
  constexpr double kLeast = 0.02;  // what is left is known no better by the trace of one probe
  least_gain_ = part_ * mean_square * solve_.WeightSum() / count_ * std::max(trace, 1.0);
  at->second = {.weight = weight,
                .score = CrossValidationScore(mean_square, trace, count_, kLeast),
                .degrees_of_freedom = trace,
                .mean_square = mean_square};
  if (IsBetter(at->second)) {
    best_ = at->second;
    best_solution_ = solve_.Solution();
  }
  return at->second;
}

void NestedWeightSearch::Scan() {
  constexpr double kTurned = 1.05;
  constexpr int kDecades = 16;
  const double even = solve_.EvenWeight();
  int turned = 0;
  for (int decade = 2; decade > 2 - kDecades && turned < 1; --decade) {
    const NestedWeight next = Try(even * std::pow(10.0, decade));
    turned += next.score <= kTurned * best_.score ? 0 : 1;
  }
}

void NestedWeightSearch::Climb(double factor, double from) {
  constexpr int kMost = 24;
  const double smoothest = kSmoothest * solve_.EvenWeight();
  Try(std::min(from, smoothest));
  for (int k = 0; k < kMost; ++k) {
    const double at = std::isnan(best_.weight) ? from : best_.weight;
    if (at * factor <= smoothest) {
      Try(at * factor);
    }
    if (std::isnan(best_.weight)) {
      from *= factor;  // so rough that no point is left to judge by
      continue;
    }
    if (best_.weight == at) {
      Try(at / factor);
    }
    if (best_.weight == at) {
      return;
    }
  }
}

void NestedWeightSearch::ClimbAnew(double factor, double from) {
  constexpr double kRough = 1e-3;
  const double rough = kRough * solve_.EvenWeight();
  Climb(factor, from);
  const double before = best_.weight;
  if (!(before > rough / factor && before < rough * std::pow(factor, 3))) {
    Try(rough);
  }
  if (best_.weight != before) {
    Climb(factor, best_.weight);
  }
}

// Whether the best weight that the search finds in other lengths predicts plainly better; else all
// is as it was. Lengths are one more number to choose, which the score knows nothing of.
template <class Search>
bool NestedWeightSearch::TryMetric(const BendingMetric& metric, const Search& search) {
  constexpr double kPlainly = 0.99;
  const BendingMetric metric_before = solve_.metric();
  const NestedWeight before = std::exchange(best_, {});
  NestedSolve::Packed solution_before = std::exchange(best_solution_, {});
  tried_.clear();
  solve_.SetMetric(metric);
  search();
  if (best_.score < kPlainly * before.score) {
    return true;
  }
  tried_.clear();
  solve_.SetMetric(metric_before);
  best_ = before;
  best_solution_ = std::move(solution_before);
  return false;
}

// The weight changes so that what the surface pays for its bending stays. A surface that is smooth
// in lengths that are too even bends too evenly: where it points to, the answer lies farther off.
void NestedWeightSearch::Stretch(double factor) {
  constexpr int kMost = 4;
  constexpr double kApart = 2;     // less is not worth the solves
  constexpr double kShare = 0.05;  // of the points: fewer parameters leave little to save
  bool better = !std::isnan(best_.weight);
  for (int k = 0; k < kMost && better && best_.degrees_of_freedom > kShare * count_; ++k) {
    Finish();
    const BendingSums bending = solve_.Bending();
    const BendingMetric from = solve_.metric(),
                        next = MetricBeyond(from, MetricOfLeastBending(bending, kMostStretch),
                                            kMostStretch);
    if (StretchBetween(from, next) < kApart) {
      return;
    }
    const double weight = best_.weight * BendingIn(from, bending) / BendingIn(next, bending);
    better = TryMetric(next, [&] { Climb(factor, weight); });
  }
}

void NestedWeightSearch::ScanStretches(double factor) {
  constexpr double kStretch = 4, kTurn_deg = 45;
  const double weight = best_.weight;
  for (int k = 0; k < 4 && !std::isnan(weight); ++k) {
    TryMetric(MakeBendingMetric({.stretch = kStretch, .direction_deg = k * kTurn_deg}),
              [&] { ClimbAnew(factor, weight); });
  }
}

double NestedWeightSearch::Between() const {
  const auto best = tried_.find(best_.weight);
  if (best == tried_.end() || best == tried_.begin() || std::next(best) == tried_.end()) {
    return best_.weight;
  }
  return WeightBetween(std::prev(best)->second, best->second, std::next(best)->second);
}

NestedWeight NestedWeightSearch::Settle(double weight) {
  constexpr double kFiner = 0.2;
  least_gain_ *= kFiner;
  best_ = {};
  tried_.clear();
  Try(weight);
  return Finish();
}

NestedWeight NestedWeightSearch::Finish() {
  if (!std::isnan(best_.weight)) {
    solve_.SetSolution(best_solution_);
    solve_.SetWeight(best_.weight);
  }
  return best_;
}

}  // namespace semblance
