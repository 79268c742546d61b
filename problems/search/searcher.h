// SPDX-License-Identifier: GPL-3.0-or-later
// A search, generation by generation: Ask for the treatments to try, run them in any order, Tell
// what they gave. What is asked for depends on the space, the options and what was told, and on
// nothing else: a search that is told the same again asks for the same again.
#pragma once

#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "problems/search/bayes_searcher.h"
#include "problems/search/cmaes_searcher.h"
#include "problems/search/halving_searcher.h"
#include "problems/search/random_searcher.h"
#include "problems/search/search_ask.h"
#include "problems/search/search_method.h"
#include "problems/search/search_space.h"

namespace semblance {

class Searcher {
 public:
  Searcher(const SearchMethod& method, const SearchSpace& space, const SearchBudget& budget);

  // The next generation; none when the budget is spent. What it costs never exceeds the budget.
  std::vector<SearchAsk> Ask();
  // A value for each that was asked for, the less the better; NaN: it could not be run, and counts
  // as worse than any.
  void Tell(std::span<const double> costs);

  // What a run of each rung costs, in full runs; 1 alone where there are no rungs.
  static std::vector<double> CostsOfRungs(const SearchMethod& method);

 private:
  std::variant<BayesSearcher, CmaEsSearcher, HalvingSearcher, RandomSearcher> searcher_;
};

}  // namespace semblance
