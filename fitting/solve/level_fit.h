// SPDX-License-Identifier: GPL-3.0-or-later
// The least-squares fit of one level of an H-spline, seen as a plain B-spline.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "fitting/problem/fit_schedule.h"
#include "fitting/terms/level_view.h"
#include "fitting/terms/term.h"
#include "surfaces/hspline/control_net.h"

namespace semblance {

struct PatchCoverage {
  int patches = -1;                   // of the level; adaptive fits: the finest everywhere
  int empty_patches = -1;             // in which no observation lies
  double median_patch_points = kNaN;  // observations in each of the others
};

// counts: of the observations, one per patch.
PatchCoverage CoverageOf(const std::vector<int>& counts);

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

struct LevelSolution {
  ControlNet net;
  LevelSummary summary;
};

// Minimises the sum of the terms over the level's control vertices: by Ceres, one thread (a
// parameter block is a vertex, or, if all terms are linear and treat x, y and z alike, one
// coordinate of 3 x 3 vertices); or, if the fastest way is asked for and all terms are linear and
// treat x, y and z alike, with one sparse Cholesky factor for the three. A loss makes either a
// sequence of such solves (space_solve.h) unless another term couples x, y and z. Where the terms
// leave vertices undetermined, the solution nearest to view.start is taken (thesis 4.2 has no word
// on it; the steps are damped by a multiple of the identity, a proximal-point iteration, which
// converges to it). Observations are used in a canonical order, so their order has no effect.
// Throws InputError if nothing can be solved: sizes that disagree, a template without extent for a
// term that needs it, or points without a foot on bone for one that looks at bone.
LevelSolution FitLevel(LevelView view, std::span<const Term> terms, Solver solver = Solver::kCeres);

}  // namespace semblance
