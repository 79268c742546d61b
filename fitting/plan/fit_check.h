// SPDX-License-Identifier: GPL-3.0-or-later
// Checks of the options and the input of a fit.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "fitting/plan/fit_options.h"
#include "fitting/problem/fit_target.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

struct FitFault {
  std::string path;  // of the option within those of the fit, such as plan.schedule[1].level
  std::string what;  // the fault and the remedy
  bool too_fine =
      false;  // the level is missing in the surface: a surface with more levels would do
};

// Returns the options that contradict each other, or that do not suit a surface whose finest level
// is max_level: everything that Fit refuses for any points and features.
std::vector<FitFault> FindFitFaults(const FitOptions& options, int max_level);

// Returns one line per option that is given but has no effect, with its path as above. This is no
// fault: a study may compare several losses, `none` among them, at one width.
std::vector<std::string> UnusedOptions(const FitOptions& options);

// Throws InputError as Fit does (fit.h).
void CheckFit(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options);

// The same for scattered points without features.
void CheckFit(const HSplineSurface& start, const ScatteredPoints& points,
              const FitOptions& options);

}  // namespace semblance::fitting
