// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/search/random_searcher.h"

#include <utility>

namespace semblance {

RandomSearcher::RandomSearcher(const RandomSearch&, SearchSpace space, const SearchBudget& budget)
    : space_(std::move(space)), random_(budget.random_seed), left_(budget.full_runs) {}

std::vector<SearchAsk> RandomSearcher::Ask() {
  std::vector<SearchAsk> asks;
  for (; left_ > 0; --left_) {
    asks.push_back({RandomPoint(space_, random_)});
  }
  return asks;
}

}  // namespace semblance
