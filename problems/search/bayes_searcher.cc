// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/search/bayes_searcher.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "problems/search/best_first.h"
#include "problems/search/unit_samples.h"

namespace semblance {
namespace {

constexpr int kEverywhere = 1000;  // candidates over the whole space
constexpr int kAround = 100;       // around each of the best known, at each distance
constexpr int kRefinements = 40;   // around the best candidate, at each distance
constexpr std::array kDistances = {0.2, 0.05, 0.0125};

Eigen::VectorXd Near(const Eigen::VectorXd& code, double distance, Random& random) {
  Eigen::VectorXd near = code;
  for (double& x : near) {
    x += distance * random.Normal();
  }
  return near;
}

// The worst finite one, or 0, in place of each that is not.
Eigen::VectorXd WithoutGaps(const std::vector<double>& costs) {
  Eigen::VectorXd all = Eigen::Map<const Eigen::VectorXd>(costs.data(), std::ssize(costs));
  double worst = -std::numeric_limits<double>::infinity();
  for (const double cost : costs) {
    worst = std::isfinite(cost) ? std::max(worst, cost) : worst;
  }
  for (double& cost : all) {
    cost = std::isfinite(cost) ? cost : std::isfinite(worst) ? worst : 0;
  }
  return all;
}

// Mean 0, deviation 1 where they differ.
Eigen::VectorXd Standardised(Eigen::VectorXd costs) {
  costs.array() -= costs.mean();
  const double sd = std::sqrt(costs.squaredNorm() / static_cast<double>(costs.size()));
  return sd > 0 ? Eigen::VectorXd(costs / sd) : costs;
}

void Append(KnownCosts& known, const Eigen::VectorXd& code, double cost) {
  const Eigen::Index n = known.costs.size();
  known.codes.conservativeResize(Eigen::NoChange, n + 1);
  known.codes.col(n) = code;
  known.costs.conservativeResize(n + 1);
  known.costs[n] = cost;
}

// The columns of the three least costs.
std::vector<std::size_t> BestOf(const KnownCosts& known) {
  std::vector<std::size_t> order =
      BestFirst({known.costs.data(), static_cast<std::size_t>(known.costs.size())});
  order.resize(std::min<std::size_t>(order.size(), 3));
  return order;
}

}  // namespace

BayesSearcher::BayesSearcher(const BayesSearch& options, SearchSpace space,
                             const SearchBudget& budget)
    : options_(options),
      space_(std::move(space)),
      random_seed_(budget.random_seed),
      random_(budget.random_seed),
      left_(budget.full_runs) {}

std::vector<SearchAsk> BayesSearcher::Ask() {
  if (asked_.empty()) {
    return FirstAsks();
  }
  std::vector<SearchAsk> asks;
  if (left_ == 0) {
    return asks;
  }
  KnownCosts known = Known();
  const SurrogateHyper hyper = FitSurrogate(known, {});
  for (int n = std::min(options_.batch, left_); n > 0; --n, --left_) {
    const Surrogate surrogate(known, hyper);
    asked_.push_back(MostPromising(surrogate, known));
    asks.push_back({asked_.back()});
    const Eigen::VectorXd code = Encode(space_, asked_.back());
    Append(known, code, surrogate.At(code).mean);
  }
  return asks;
}

void BayesSearcher::Tell(std::span<const double> costs) {
  costs_.insert(costs_.end(), costs.begin(), costs.end());
}

std::vector<SearchAsk> BayesSearcher::FirstAsks() {
  const int axes = static_cast<int>(space_.size());
  const int count = std::min(options_.initial.value_or(2 * axes + 2), left_);
  std::vector<SearchAsk> asks;
  for (const auto& shares : UnitSamples(SampleMethod::kLhs, count, axes, random_seed_)) {
    asked_.push_back(PointAt(space_, shares));
    asks.push_back({asked_.back()});
  }
  left_ -= count;
  return asks;
}

KnownCosts BayesSearcher::Known() const {
  KnownCosts known{
      .codes = {}, .costs = Standardised(WithoutGaps(costs_)), .axes_of_code = AxesOfCode(space_)};
  known.codes.resize(std::ssize(known.axes_of_code), known.costs.size());
  for (Eigen::Index n = 0; n < known.costs.size(); ++n) {
    known.codes.col(n) = Encode(space_, asked_[static_cast<std::size_t>(n)]);
  }
  return known;
}

std::vector<SearchPoint> BayesSearcher::Candidates(const KnownCosts& known) {
  std::vector<SearchPoint> candidates;
  for (int n = 0; n < kEverywhere; ++n) {
    candidates.push_back(RandomPoint(space_, random_));
  }
  for (const std::size_t best : BestOf(known)) {
    for (const double distance : kDistances) {
      for (int n = 0; n < kAround; ++n) {
        candidates.push_back(Decode(
            space_, Near(known.codes.col(static_cast<Eigen::Index>(best)), distance, random_)));
      }
    }
  }
  return candidates;
}

SearchPoint BayesSearcher::MostPromising(const Surrogate& surrogate, const KnownCosts& known) {
  const double least = known.costs.minCoeff();
  SearchPoint best = RandomPoint(space_, random_);
  std::pair<double, double> most = {-1, -1};  // improvement, then how unknown it is
  const auto consider = [&](SearchPoint point) {
    if (IsAsked(point)) {
      return;
    }
    const ExpectedCost cost = surrogate.At(Encode(space_, point));
    const std::pair worth(ExpectedImprovement(cost, least), cost.sd);
    if (worth > most) {
      most = worth;
      best = std::move(point);
    }
  };
  for (SearchPoint& candidate : Candidates(known)) {
    consider(std::move(candidate));
  }
  for (const double distance : kDistances) {
    for (int n = 0; n < kRefinements; ++n) {
      consider(Decode(space_, Near(Encode(space_, best), 0.5 * distance, random_)));
    }
  }
  return best;
}

bool BayesSearcher::IsAsked(const SearchPoint& point) const {
  return std::ranges::find(asked_, point) != asked_.end();
}

}  // namespace semblance
