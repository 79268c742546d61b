// SPDX-License-Identifier: GPL-3.0-or-later
// What a solve tells of itself.
#pragma once

#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

// What a solve measures beside what it needs. Of rounds that follow each other only the last is
// told of, and measuring is a good part of a round.
enum class SolveReport { kFull, kNone };

struct PatchCoverage {
  int patches = -1;                   // of the level; adaptive fits: the finest everywhere
  int empty_patches = -1;             // in which no observation lies
  double median_patch_points = kNaN;  // observations in each of the others
};

struct TermCosts {
  std::string term;      // its kName
  double before = kNaN;  // mm^2, at LevelView::start
  double after = kNaN;   // mm^2, at the solution, before any fraction is taken
};

struct LevelSummary {
  int level = -1;                // set by Fit
  double fraction = kNaN;        // set by Fit
  std::vector<TermCosts> terms;  // in the order of the terms
  double rms_before_mm = kNaN;   // of the observations, weighted
  double rms_after_mm = kNaN;    // at the solution; Fit gives that of the surface it wrote back
  int iterations = -1;           // of the solver
  int free_vertices = -1;        // that some term touches; all others stay
  int uncovered_vertices = -1;   // that no observation touches
  PatchCoverage coverage = {};   // of the patches by the observations
  int rank = -1;  // estimated numerical rank of the observations' matrix; free_vertices - rank
                  // directions are left to the other terms, or stay; -1: not asked (adaptive fits
                  // ask at the end)
  double max_move_mm = kNaN;       // of a vertex, at the solution; Fit: as written back
  double auto_weight = kNaN;       // what `weight: auto` became, if a term has it
  std::string solver = "not run";  // ceres or direct
  std::string termination = "not run";
  bool usable = false;  // the solver's solution can be used; else the net is unchanged
};

}  // namespace semblance
