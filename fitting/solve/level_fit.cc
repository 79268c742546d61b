// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/level_fit.h"

#include <algorithm>
#include <utility>

#include "fitting/solve/space_solve.h"

namespace semblance {

LevelSolution FitLevel(LevelView view, std::span<const Term> terms, Solver solver) {
  LevelSolution solution{.net = view.start, .summary = {}};
  SpaceSolve solve(std::move(view), terms, solver);
  solution.summary = solve.Settle();
  solution.net.vertices = solve.Values().vertices;
  return solution;
}

PatchCoverage CoverageOf(std::vector<int> counts) {
  PatchCoverage coverage{.patches = static_cast<int>(counts.size()), .empty_patches = 0};
  coverage.empty_patches = static_cast<int>(std::erase(counts, 0));
  if (!counts.empty()) {
    const auto upper = counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2);
    std::nth_element(counts.begin(), upper, counts.end());
    const int lower = counts.size() % 2 == 1 ? *upper : *std::max_element(counts.begin(), upper);
    coverage.median_patch_points = (*upper + lower) / 2.0;
  }
  return coverage;
}

}  // namespace semblance
