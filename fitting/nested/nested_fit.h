// SPDX-License-Identifier: GPL-3.0-or-later
// The fit that asks for no tolerance: how fine, how smooth and which points to believe follow from
// the points (`plan: auto`).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fitting/problem/fit_schedule.h"
#include "fitting/problem/fit_target.h"
#include "surfaces/base/run_context.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

struct NestedRound {
  int finest = -1;                   // level
  int vertices = -1;                 // that say something of their own
  double weight = kNaN;              // of the thin-plate energy, mm^4 (SmoothnessTerm, length_mm 1)
  double stretch = 1;                // of the lengths in which it is measured (SmoothnessTerm)
  double direction_deg = 0;          // of the stretch
  double degrees_of_freedom = kNaN;  // trace of the influence matrix
  double rms_mm = kNaN;              // of the points that were fitted, along one axis, weighted
  double held_out_rms_mm = kNaN;     // of the points that were not, weighted
  int steps = -1;                    // of conjugate gradients
  int outliers = -1;
};

// What the fit assumed, and how far that holds. Of points with weights what is said of noise and of
// points held out is said of one of mean weight: errors count by sqrt(weight / mean weight), the
// mean being that of the points that are no outliers.
struct AutoReport {
  std::vector<NestedRound> rounds;
  int chosen_round = -1;
  double weight = kNaN;                 // of the thin-plate energy, as NestedRound; all points
  double length_mm = 1;                 // of the smoothness that the weights are for
  double stretch = 1;                   // likewise
  double direction_deg = 0;             // likewise
  double noise_mm = kNaN;               // standard deviation of a point along one axis, by the fit
  double neighbour_noise_mm = kNaN;     // by a quadratic through each point's 20 neighbours
  double closer_noise_mm = kNaN;        // by a plane through 8: less, if detail passes for noise
  double held_out_rms_mm = kNaN;        // along one axis, of a tenth that took no part
  double neighbour_correlation = kNaN;  // of residuals of points that are next to each other
  bool weighted = false;                // some points weigh more than others
  bool met_to_rounding = false;         // held out to 1e-8 of the extent: nothing to refine for
  bool limited_by_density = false;      // finer vertices would have fewer points than they need
  std::vector<std::uint32_t> outliers;  // indices as given, ascending; they have no weight
  std::vector<std::uint32_t> repeated;  // likewise, of copies of other points; those count once
};

struct NestedFitResult {
  HSplineSurface surface;  // its finest level is the finest that has vertices
  AutoReport report;
  std::vector<Vec2> uv;             // per point as given
  std::vector<double> residual_mm;  // per point as given: its distance from the surface
  double rms_mm = kNaN;             // of the distances, weighted
};

// A tenth of the points is held out. In rounds: the thin-plate weight by generalised
// cross-validation, and with the plan's `stretched` in which lengths it measures bending; outliers
// (outlier_search.h), and finer vertices where residuals are correlated (unresolved_detail.h), as
// long as there are such places or points are dense. Of all rounds the one that predicts the points
// held out best, or within a tenth of a per cent the coarsest, is fitted again to all points. With
// many points the first rounds look at some of them.
//   start: without detail; what it leaves of the points is smoothed, not the surface itself.
// Copies of a point count once. Throws InputError for a start with detail, without extent, or fewer
// than 16 points that differ; Cancelled.
NestedFitResult FitNested(const HSplineSurface& start, const ScatteredPoints& points,
                          const AutoPlan& plan, const RunContext& context);

}  // namespace semblance
