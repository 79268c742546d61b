// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit can be asked for.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "fitting/plan/fit_options.h"
#include "fitting/problem/fit_target.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

struct FitFault {
  std::string path;       // of the option within the fit's: plan.schedule[1].level
  std::string what;       // is wrong, and what to do
  bool too_fine = false;  // a level that the surface does not have: a finer one would do
};

// Options that are right each by itself but not together, or not for a surface whose finest level
// is max_level. Everything that Fit refuses whatever the points and features are.
std::vector<FitFault> FaultsOf(const FitOptions& options, int max_level);

// What is given and not looked at, a line each, with the option's path as above. No fault: a study
// may compare losses, none among them, at one width.
std::vector<std::string> UnusedOptions(const FitOptions& options);

// Throws InputError as Fit does (fit.h).
void CheckFit(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options);

// The same of scattered points without features.
void CheckFit(const HSplineSurface& start, const ScatteredPoints& points,
              const FitOptions& options);

}  // namespace semblance
