// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/search/halving_searcher.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "problems/search/best_first.h"

namespace semblance {
namespace {

int Promoted(int points, double eta) { return std::max(1, static_cast<int>(points / eta)); }

}  // namespace

HalvingSearcher::HalvingSearcher(const HalvingSearch& options, SearchSpace space,
                                 const SearchBudget& budget)
    : options_(options),
      space_(std::move(space)),
      random_(budget.random_seed),
      rung_costs_(CostsOfRungs(options)),
      left_(budget.full_runs) {}

std::vector<double> HalvingSearcher::CostsOfRungs(const HalvingSearch& options) {
  std::vector<double> costs;
  for (int rung = 1; rung <= options.rungs; ++rung) {
    costs.push_back(std::pow(options.eta, rung - options.rungs));
  }
  return costs;
}

std::vector<SearchAsk> HalvingSearcher::Ask() {
  if (points_.empty() && !BeginBracket()) {
    return {};
  }
  std::vector<SearchAsk> asks;
  for (const SearchPoint& point : points_) {
    asks.push_back({point, rung_});
  }
  return asks;
}

void HalvingSearcher::Tell(std::span<const double> costs) {
  if (rung_ + 1 == options_.rungs) {
    points_.clear();
    return;
  }
  std::vector<std::size_t> order = BestFirst(costs);
  order.resize(static_cast<std::size_t>(Promoted(static_cast<int>(order.size()), options_.eta)));
  std::vector<SearchPoint> promoted;
  for (const std::size_t i : order) {
    promoted.push_back(points_[i]);
  }
  points_ = std::move(promoted);
  ++rung_;
}

// The next bracket that the budget has room for, with as many points as it allows.
bool HalvingSearcher::BeginBracket() {
  for (; next_first_rung_ < options_.rungs; ++next_first_rung_) {
    const int above = options_.rungs - 1 - next_first_rung_;
    int points = static_cast<int>(
        std::ceil(options_.rungs / (above + 1.0) * std::pow(options_.eta, above) - 1e-9));
    while (points > 0 && CostOfBracket(points, next_first_rung_) > left_ + 1e-9) {
      --points;
    }
    if (points > 0) {
      left_ -= CostOfBracket(points, next_first_rung_);
      rung_ = next_first_rung_;
      for (int n = 0; n < points; ++n) {
        points_.push_back(RandomPoint(space_, random_));
      }
      const bool is_last = next_first_rung_ + 1 == options_.rungs;
      next_first_rung_ =
          is_last || options_.brackets == Brackets::kFirst ? 0 : next_first_rung_ + 1;
      return true;
    }
  }
  return false;
}

double HalvingSearcher::CostOfBracket(int points, int first_rung) const {
  double cost = 0;
  for (int rung = first_rung; rung < options_.rungs; ++rung) {
    cost += points * rung_costs_[static_cast<std::size_t>(rung)];
    points = Promoted(points, options_.eta);
  }
  return cost;
}

}  // namespace semblance
