// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/search/searcher.h"

namespace semblance {
namespace {

BayesSearcher Make(const BayesSearch& options, const SearchSpace& space,
                   const SearchBudget& budget) {
  return {options, space, budget};
}
CmaEsSearcher Make(const CmaEsSearch& options, const SearchSpace& space,
                   const SearchBudget& budget) {
  return {options, space, budget};
}
HalvingSearcher Make(const HalvingSearch& options, const SearchSpace& space,
                     const SearchBudget& budget) {
  return {options, space, budget};
}
RandomSearcher Make(const RandomSearch& options, const SearchSpace& space,
                    const SearchBudget& budget) {
  return {options, space, budget};
}

using AnySearcher = std::variant<BayesSearcher, CmaEsSearcher, HalvingSearcher, RandomSearcher>;

}  // namespace

Searcher::Searcher(const SearchMethod& method, const SearchSpace& space, const SearchBudget& budget)
    : searcher_(std::visit(
          [&](const auto& options) { return AnySearcher(Make(options, space, budget)); }, method)) {
}

std::vector<SearchAsk> Searcher::Ask() {
  return std::visit([](auto& searcher) { return searcher.Ask(); }, searcher_);
}

void Searcher::Tell(std::span<const double> costs) {
  std::visit([&](auto& searcher) { searcher.Tell(costs); }, searcher_);
}

std::vector<double> Searcher::CostsOfRungs(const SearchMethod& method) {
  const auto* halving = std::get_if<HalvingSearch>(&method);
  return halving ? HalvingSearcher::CostsOfRungs(*halving) : std::vector<double>{1};
}

}  // namespace semblance
