// SPDX-License-Identifier: GPL-3.0-or-later
// The nested fit (`plan: auto`): it needs no tolerance, and chooses the resolution, the smoothness
// and the outliers from the points.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fitting/problem/fit_schedule.h"
#include "fitting/problem/fit_target.h"
#include "surfaces/base/run_context.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

struct NestedPoints;  // nested_points.h

struct NestedRound {
  int finest = -1;                   // level
  int vertices = -1;                 // independent vertices (NestedSpace::Vertices)
  double weight = kNaN;              // of the thin-plate energy, mm^4 (SmoothnessTerm, length_mm 1)
  double stretch = 1;                // of bending (SmoothnessTerm)
  double direction_deg = 0;          // direction of the stretch
  double degrees_of_freedom = kNaN;  // trace of the influence matrix
  double rms_mm = kNaN;              // of the fitted points along one axis, weighted
  double held_out_rms_mm = kNaN;     // of the points held out along one axis, weighted
  int steps = -1;                    // steps of conjugate gradients
  int outliers = -1;
};

// The noise of the lighter and of the heavier ones of weighted points, each with their median
// weight. The weights themselves take no part in the noise: where they are right, the heavier
// points have less of it. NaN where either are too few.
struct NoiseByWeight {
  double light_mm = kNaN, heavy_mm = kNaN;          // by planes through 8 neighbours among them
  double light_weight = kNaN, heavy_weight = kNaN;  // > 0
};

// The assumptions of the fit, and measures of their validity. For points with weights, noise and
// held-out errors refer to an inlier of mean weight: errors are multiplied by sqrt(weight / mean
// weight), where the mean is over the points that are not outliers.
struct AutoReport {
  std::vector<NestedRound> rounds;
  int chosen_round = -1;
  double weight = kNaN;                 // of the final fit to all points, as in NestedRound
  double length_mm = 1;                 // SmoothnessTerm::length_mm of the weights
  double degrees_of_freedom = kNaN;     // of the final fit
  double stretch = 1;                   // of the final fit
  double direction_deg = 0;             // of the final fit
  double noise_mm = kNaN;               // standard deviation of a point along one axis, by the fit
  double neighbour_noise_mm = kNaN;     // the same, by quadratics through 20 neighbours
  double closer_noise_mm = kNaN;        // by planes through 8; smaller if detail passes for noise
  NoiseByWeight by_weight;              // of weighted points
  double held_out_rms_mm = kNaN;        // along one axis, of the tenth that was held out
  double neighbour_correlation = kNaN;  // of residuals of consecutive points on the curve
  double effective_share = 1;           // independent points per point, by correlated residuals
  int runs = 0;                         // runs of the file with offsets of their own
  double run_offset_mm = kNaN;          // standard deviation of these offsets, a part of noise_mm
  double lattice_mm = 0;                // step of heights that were rounded to it; 0: they were not
  bool outliers_together = false;       // outliers stand together, as on a narrow ridge
  bool has_long_tail = false;           // of the residuals; set by a caller that judges them
  bool weighted = false;                // the points' weights differ
  bool met_to_rounding = false;         // held-out points are met to 1e-8 of the extent
  bool limited_by_density = false;      // finer vertices would have too few points
  std::vector<std::uint32_t> outliers;  // given indices, ascending; these points have no weight
  std::vector<std::uint32_t> repeated;  // given indices of copies, ascending; copies count once
  int near_copies = 0;                  // copies among them that were moved a little
  int measured_twice = 0;               // points at the places of others that are no copies
};

struct NestedFitResult {
  HSplineSurface surface;  // its max_level is the finest level with vertices
  AutoReport report;
  std::vector<Vec2> uv;             // in the given order
  std::vector<double> residual_mm;  // distances from the surface, in the given order
  double rms_mm = kNaN;             // root mean square of the distances, weighted
};

// Fits a surface in rounds, with a tenth of the points held out. A round chooses the thin-plate
// weight by generalised cross-validation, and with the plan's `stretched` the metric of bending; it
// finds outliers (outlier_search.h), and adds finer vertices where residuals are correlated
// (unresolved_detail.h) or points are dense. The round that predicts the held-out points best
// (within 0.1 %, the coarsest) is then fitted to all points. With many points the first rounds use
// a sample. nested_fit.cc shows the states and invariants.
//   start: without detail. Its difference from the points is smoothed, not the surface itself.
// Copies of a point count once, also those that a second export moved a little (nested_points.h).
// Throws InputError for a start with detail or without extent, or for
// fewer than 16 distinct points; Cancelled.
NestedFitResult FitNested(const HSplineSurface& start, const ScatteredPoints& points,
                          const AutoPlan& plan, const RunContext& context);

// The following functions split FitNested into steps, between which the given points may be freed.

// Throws InputError like FitNested.
void CheckNested(const HSplineSurface& start, const ScatteredPoints& points);

// points: made by DisplacementsFrom or TakeDisplacements from points that passed CheckNested.
NestedFitResult FitNested(const HSplineSurface& start, NestedPoints points, const AutoPlan& plan,
                          const RunContext& context);

// Updates the report for another surface, which other terms or exact points have made of the fitted
// one. Noise and the correlation of neighbours become those of `surface`. If it is clearly farther
// from the points, the statements about held-out points, density and round-off are withdrawn.
//   residual_mm: distances from the fitted surface.
void UpdateReport(const HSplineSurface& surface, const ScatteredPoints& points,
                  std::span<const double> residual_mm, int threads, AutoReport& report);

}  // namespace semblance::fitting
