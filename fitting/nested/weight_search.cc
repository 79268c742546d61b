// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/weight_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "fitting/least_squares/cross_validation.h"

namespace semblance::fitting {
namespace {

// The constants below trade solves (time) against a better score. They were chosen on the sets of
// docs/explanation/fit.md, "How good it is".

// Largest weight, relative to the weight at which points and energy balance. Only a plane is left
// there.
constexpr double kMaxWeightRatio = 100;
// Largest stretch of a metric. Larger ones leave almost no bending across the direction.
constexpr double kMaxStretch = 16;

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

double NestedWeight::NoiseSquare(double count) const {
  constexpr double kMinLeft = 0.02;  // the trace of one probe is no more accurate than this
  return mean_square / std::max(1 - degrees_of_freedom / count, kMinLeft);
}

// If two scores are equal, the larger weight is better, so that round-off does not decide.
bool NestedWeightSearch::IsBetter(const NestedWeight& next) const {
  constexpr double kEqual = 1e-5;  // relative; far above round-off, far below any real difference
  const double smoother = next.weight > best_.weight ? kEqual : -kEqual;
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
  // Error of the trace from one probe, as a share of the points.
  constexpr double kMinShareLeft = 0.02;
  least_gain_ = part_ * mean_square * solve_.WeightSum() / count_ * std::max(trace, 1.0);
  at->second = {.weight = weight,
                .score = CrossValidationScore(mean_square, trace, count_, kMinShareLeft),
                .degrees_of_freedom = trace,
                .mean_square = mean_square};
  if (IsBetter(at->second)) {
    best_ = at->second;
    best_solution_ = solve_.Solution();
  }
  return at->second;
}

void NestedWeightSearch::Scan() {
  constexpr double kTurned = 1.05;  // a score that has clearly risen above the best
  constexpr int kDecades = 16;      // from 1e2 to 1e-13: down to interpolation in round-off
  const double even = solve_.EvenWeight();
  int turned = 0;
  for (int decade = 2; decade > 2 - kDecades && turned < 1; --decade) {
    const NestedWeight next = Try(even * std::pow(10.0, decade));
    turned += next.score <= kTurned * best_.score ? 0 : 1;
  }
}

void NestedWeightSearch::Climb(double factor, double from) {
  constexpr int kMaxTries = 24;  // never reached in practice; bounds the loop
  const double smoothest = kMaxWeightRatio * solve_.EvenWeight();
  Try(std::min(from, smoothest));
  for (int k = 0; k < kMaxTries; ++k) {
    const double at = std::isnan(best_.weight) ? from : best_.weight;
    if (at * factor <= smoothest) {
      Try(at * factor);
    }
    if (std::isnan(best_.weight)) {
      from *= factor;  // too rough: no point is left for the score
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

void NestedWeightSearch::ClimbFromRough(double factor, double from) {
  constexpr double kRoughRatio = 1e-3;  // of the balanced weight; rough enough to show new detail
  const double rough = kRoughRatio * solve_.EvenWeight();
  Climb(factor, from);
  const double before = best_.weight;
  if (!(before > rough / factor && before < rough * std::pow(factor, 3))) {
    Try(rough);
  }
  if (best_.weight != before) {
    Climb(factor, best_.weight);
  }
}

// Searches with another metric. Returns whether its best score is clearly better; otherwise
// restores everything. A margin is needed because the score does not account for the choice of the
// metric.
template <class Search>
bool NestedWeightSearch::TryMetric(const BendingMetric& metric, const Search& search) {
  constexpr double kClearly = 0.99;  // share of the old score
  const BendingMetric metric_before = solve_.metric();
  const NestedWeight before = std::exchange(best_, {});
  NestedSolve::Packed solution_before = std::exchange(best_solution_, {});
  tried_.clear();
  solve_.SetMetric(metric);
  search();
  if (best_.score < kClearly * before.score) {
    return true;
  }
  tried_.clear();
  solve_.SetMetric(metric_before);
  best_ = before;
  best_solution_ = std::move(solution_before);
  return false;
}

// The weight changes so that the present surface's cost of bending stays the same. A surface that
// was smoothed with too little stretch bends too evenly, so the search goes beyond the metric in
// which the surface bends least.
void NestedWeightSearch::Stretch(double factor) {
  constexpr int kMaxSteps = 4;       // of the metric; each doubles the stretch at least
  constexpr double kMinStretch = 2;  // between metrics; less is not worth the solves
  // Smallest number of parameters per point; below, a better metric saves next to nothing. Without
  // this limit a million points of ripples took 24 s instead of 0.9 s.
  constexpr double kMinParameters = 0.05;
  bool better = !std::isnan(best_.weight);
  for (int k = 0; k < kMaxSteps && better && best_.degrees_of_freedom > kMinParameters * count_;
       ++k) {
    Finish();
    const BendingSums bending = solve_.Bending();
    const BendingMetric from = solve_.metric(),
                        next = MetricBeyond(from, MetricOfLeastBending(bending, kMaxStretch),
                                            kMaxStretch);
    if (StretchBetween(from, next) < kMinStretch) {
      return;
    }
    const double weight = best_.weight * BendingIn(from, bending) / BendingIn(next, bending);
    better = TryMetric(next, [&] { Climb(factor, weight); });
  }
}

void NestedWeightSearch::ScanStretches(double factor) {
  constexpr double kStretch = 4, kTurn_deg = 45;  // coarse steps; Stretch refines them
  const double weight = best_.weight;
  for (int k = 0; k < 4 && !std::isnan(weight); ++k) {
    TryMetric(MakeBendingMetric({.stretch = kStretch, .direction_deg = k * kTurn_deg}),
              [&] { ClimbFromRough(factor, weight); });
  }
}

double NestedWeightSearch::Between() const {
  const auto best = tried_.find(best_.weight);
  if (best == tried_.end() || best == tried_.begin() || std::next(best) == tried_.end()) {
    return best_.weight;
  }
  return WeightBetween(std::prev(best)->second, best->second, std::next(best)->second);
}

NestedWeight NestedWeightSearch::FinalSolve(double weight) {
  // Remaining gain relative to that of comparisons: 0.1 becomes 1/50.
  constexpr double kFiner = 0.2;
  least_gain_ *= kFiner;
  best_ = {};
  tried_.clear();
  Try(weight);
  return Finish();
}

// Makes a weight the best, whatever its score.
void NestedWeightSearch::Take(double weight) {
  best_ = {};
  tried_.erase(weight);
  Try(weight);
}

NestedWeight NestedWeightSearch::SmoothWhileFits(const std::function<double()>& misfit) {
  constexpr double kFactor = 2;
  // Largest misfit, relative to its least: distances twice as large. Larger values smooth too much,
  // smaller ones follow the rounding. It was tried on Franke's function, waves and hills of heights
  // 10 and 30, rounded to whole numbers, with 1e4 and 1e5 points.
  constexpr double kNearLeast = 4;
  const double smoothest = kMaxWeightRatio * solve_.EvenWeight();
  Finish();
  double least = misfit(), weight = best_.weight;
  double next = weight * kFactor;
  while (next < smoothest) {
    Take(next);
    const double square = misfit();
    least = std::min(least, square);
    if (square > kNearLeast * least) {
      break;
    }
    weight = next;
    next *= kFactor;
  }
  Take(weight);
  return Finish();
}

// Returns the growth of the sum of squared residuals over that of their degrees of freedom. With
// the influence matrix S residuals have n - 2 tr S + tr S^2 degrees of freedom, and tr S^2 is tr S
// / 2 for a thin plate over evenly spread points.
double NestedWeightSearch::SquarePerParameter(const NestedWeight& rougher,
                                              const NestedWeight& smoother) const {
  constexpr double kFreed = 1.5;  // degrees of freedom per parameter less
  return count_ * (smoother.mean_square - rougher.mean_square) /
         (kFreed * (rougher.degrees_of_freedom - smoother.degrees_of_freedom));
}

namespace {

// The step at whose end residuals have let go of shared errors: the last flat step before a steep
// one; -1 if there is none. rises: log2 of the growth of the residuals' squares, per step.
std::ptrdiff_t KneeOf(const std::vector<double>& rises) {
  struct Bend {
    double steep, flat;
  };
  // A plain knee, and one between a flatter and a less steep part, as of many points.
  constexpr std::array<Bend, 2> kBends = {Bend{1.7, 1.3}, Bend{1.4, 0.7}};
  std::ptrdiff_t knee = -1;
  for (const Bend& bend : kBends) {
    const auto up =
        std::find_if(rises.rbegin(), rises.rend(), [&](double rise) { return rise > bend.steep; });
    const auto flat = std::find_if(up, rises.rend(), [&](double rise) { return rise < bend.flat; });
    knee = std::max(knee, rises.rend() - flat - 1);
  }
  return knee;
}

}  // namespace

// The constants were chosen on Franke's function, hills, waves and bumps with errors correlated
// over 0, 0.01, 0.02 and 0.04 of the domain (exponential and Gaussian), with 3e3 to 3e4 points. The
// knee found there was the weight of least error. On rough terrain (H = 0.5 and 0.8), creases,
// steps and lattices of bumps none was found.
std::optional<SharedErrors> NestedWeightSearch::FindSharedErrors(double from, double most) {
  constexpr double kFactor = 4;
  // Steps to the knee; fewer are within the choice of cross-validation itself.
  constexpr std::ptrdiff_t kFewest = 3, kMost = 16;
  std::vector<NestedWeight> tried = {Try(from)};
  std::vector<double> rises;
  while (std::ssize(rises) < kMost && tried.back().mean_square < most) {
    const double before = tried.back().mean_square;
    tried.push_back(Try(tried.back().weight * kFactor));
    rises.push_back(std::log2(tried.back().mean_square / before));
  }
  const std::ptrdiff_t knee = KneeOf(rises);
  if (knee < kFewest) {
    return std::nullopt;
  }
  // The step before the knee has too little of the errors, the step after it some of the surface.
  const double before = SquarePerParameter(tried[knee - 1], tried[knee]),
               after = SquarePerParameter(tried[knee], tried[knee + 1]);
  return SharedErrors{.weight = tried[knee].weight,
                      .square_per_parameter = std::sqrt(before * after)};
}

NestedWeight NestedWeightSearch::Finish() {
  if (!std::isnan(best_.weight)) {
    solve_.SetSolution(best_solution_);
    solve_.SetWeight(best_.weight);
  }
  return best_;
}

}  // namespace semblance::fitting
