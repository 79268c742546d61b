// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "problems/search/search_ask.h"
#include "problems/search/search_method.h"

namespace semblance {

// All at once, for none depends on another.
class RandomSearcher {
 public:
  RandomSearcher(const RandomSearch&, SearchSpace space, const SearchBudget& budget);
  std::vector<SearchAsk> Ask();
  void Tell(std::span<const double>) {}

 private:
  SearchSpace space_;
  Random random_;
  int left_;
};

}  // namespace semblance
