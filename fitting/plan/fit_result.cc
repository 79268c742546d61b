// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/plan/fit_result.h"

#include <fmt/format.h>

#include <cmath>

namespace semblance::fitting {

std::vector<std::string> FaultsIn(const FitResult& fit) {
  if (fit.usable) {
    return {};
  }
  if (!std::isfinite(fit.point_rms_mm)) {
    return {
        "the points' distances from the surface are not finite numbers; look for huge "
        "coordinates and weights"};
  }
  std::vector<std::string> faults;
  for (std::size_t k = 0; k < fit.levels.size(); ++k) {
    if (!fit.levels[k].usable) {
      faults.push_back(fmt::format("step {} of the fit, on level {}, ended without a solution ({})",
                                   k + 1, fit.levels[k].level, fit.levels[k].solver));
    }
  }
  return faults.empty() ? std::vector<std::string>{"the fit was not done"} : faults;
}

}  // namespace semblance::fitting
