// SPDX-License-Identifier: GPL-3.0-or-later
// The summary of a solve.
#pragma once

#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::fitting {

// Selects whether a solve also measures term costs, coverage and rank. Measuring takes a good part
// of a round, so only the last of several rounds makes a full report.
enum class SolveReport { kFull, kNone };

struct PatchCoverage {
  int patches = -1;                   // patches of the level; adaptive fits: all leaves
  int empty_patches = -1;             // patches without an observation
  double median_patch_points = kNaN;  // median number of observations in the other patches
};

struct TermCosts {
  std::string term;      // its kName
  double before = kNaN;  // mm^2, at LevelView::start
  double after = kNaN;   // mm^2, at the solution, before the step's fraction is applied
};

// A vertex counts as moved from this move on.
inline constexpr double kLeastMove_mm = 0.01;

struct LevelSummary {
  int level = -1;                // set by Fit
  double fraction = kNaN;        // set by Fit
  std::vector<TermCosts> terms;  // in the order of the terms
  double rms_before_mm = kNaN;   // root mean square distance of the observations, weighted
  double rms_after_mm = kNaN;    // at the solution; Fit: after the step's fraction
  int iterations = -1;           // iterations of the solver
  int free_vertices = -1;        // vertices with an effect on some term; all others stay
  int uncovered_vertices = -1;   // vertices without an observation in their support
  PatchCoverage coverage = {};   // observations per patch
  // Estimated numerical rank of the observations' matrix; free_vertices - rank directions are left
  // to the other terms, or stay. -1: not computed (adaptive fits compute it at the end).
  int rank = -1;
  int moved_vertices = -1;    // vertices that the step moved; -1: not counted (adaptive fits)
  double max_move_mm = kNaN;  // largest move of a vertex; Fit: after the step's fraction
  double auto_weight = kNaN;  // weight that was chosen for `weight: auto`, if a term has it
  // Weight of the hold that kept weakly determined vertices from running away (FitLevelHeld); 0:
  // none.
  double hold = 0;
  std::string solver = "not run";  // ceres or direct
  std::string termination = "not run";
  bool usable = false;  // false: the solver failed and the net is unchanged
};

}  // namespace semblance::fitting
