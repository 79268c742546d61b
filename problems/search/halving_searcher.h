// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "problems/search/search_ask.h"
#include "problems/search/search_method.h"

namespace semblance {

// Brackets of random points, each a rung after the other, until the budget has no room for one
// that ends with a run in full (Li et al. 2018, algorithm 1, where R is a full run and s counts the
// rungs above the first; the last brackets are as large as the budget allows).
class HalvingSearcher {
 public:
  HalvingSearcher(const HalvingSearch& options, SearchSpace space, const SearchBudget& budget);
  std::vector<SearchAsk> Ask();
  void Tell(std::span<const double> costs);

  // What a run of each rung costs, in full runs: eta times more from rung to rung.
  static std::vector<double> CostsOfRungs(const HalvingSearch& options);

 private:
  bool BeginBracket();
  double CostOfBracket(int points, int first_rung) const;

  HalvingSearch options_;
  SearchSpace space_;
  Random random_;
  std::vector<double> rung_costs_;
  double left_;  // of the budget
  int next_first_rung_ = 0;
  int rung_ = 0;
  std::vector<SearchPoint> points_;  // of the bracket at hand that go on; empty: it is over
};

}  // namespace semblance
