// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/level_fit.h"

#include <algorithm>
#include <utility>

#include "fitting/solve/space_solve.h"
#include "surfaces/base/quantile.h"

namespace semblance {

LevelSolution FitLevel(LevelView view, std::span<const Term> terms, Solver solver,
                       SolveReport report) {
  LevelSolution solution{.net = view.start, .summary = {}};
  SpaceSolve solve(std::move(view), terms, solver);
  solution.summary = solve.Settle(report);
  solution.net.vertices = solve.Values().vertices;
  return solution;
}

PatchCoverage CoverageOf(const std::vector<int>& counts) {
  std::vector<double> filled(counts.begin(), counts.end());
  const auto empty = static_cast<int>(std::erase(filled, 0));
  PatchCoverage coverage{.patches = static_cast<int>(counts.size()), .empty_patches = empty};
  if (!filled.empty()) {
    coverage.median_patch_points = Quantile(filled, 0.5);
  }
  return coverage;
}

}  // namespace semblance
