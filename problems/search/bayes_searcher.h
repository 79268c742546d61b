// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "problems/search/search_ask.h"
#include "problems/search/search_method.h"
#include "problems/search/surrogate.h"

namespace semblance {

// A Latin hypercube, then a few at a time where the surrogate expects most improvement. What could
// not be run counts as the worst that could. No point is asked for twice while others are left.
class BayesSearcher {
 public:
  BayesSearcher(const BayesSearch& options, SearchSpace space, const SearchBudget& budget);
  std::vector<SearchAsk> Ask();
  void Tell(std::span<const double> costs);

 private:
  std::vector<SearchAsk> FirstAsks();
  KnownCosts Known() const;
  SearchPoint MostPromising(const Surrogate& surrogate, const KnownCosts& known);
  std::vector<SearchPoint> Candidates(const KnownCosts& known);
  bool IsAsked(const SearchPoint& point) const;

  BayesSearch options_;
  SearchSpace space_;
  std::uint64_t random_seed_;
  Random random_;
  int left_;
  std::vector<SearchPoint> asked_;
  std::vector<double> costs_;  // of those that were told
};

}  // namespace semblance
