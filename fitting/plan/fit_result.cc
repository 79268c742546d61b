// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/plan/fit_result.h"

#include <fmt/format.h>

namespace semblance::fitting {

std::vector<std::string> FaultsIn(const FitResult& fit) {
  if (fit.usable) {
    return {};
  }
  std::vector<std::string> faults;
  for (std::size_t k = 0; k < fit.levels.size(); ++k) {
    if (!fit.levels[k].usable) {
      faults.push_back(fmt::format("step {} of the fit, on level {}, ended without a solution ({})",
                                   k + 1, fit.levels[k].level, fit.levels[k].solver));
    }
  }
  if (faults.empty()) {  // each step has a solution, but its distances do not
    faults.emplace_back(fit.levels.empty()
                            ? "the fit was not done"
                            : "the points' distances from the surface are not finite numbers; look "
                              "for huge coordinates and weights");
  }
  return faults;
}

}  // namespace semblance::fitting
