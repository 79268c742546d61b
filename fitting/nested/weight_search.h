// SPDX-License-Identifier: GPL-3.0-or-later
// The choice of a nested fit's thin-plate weight and bending metric by generalised
// cross-validation.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>

#include "fitting/nested/nested_solve.h"

namespace semblance::fitting {

struct NestedWeight {
  double weight = kNaN;
  double score = kNaN;               // score of cross-validation, mm^2 along one axis
  double degrees_of_freedom = kNaN;  // trace of the influence matrix
  double mean_square = kNaN;         // mean squared residual along one axis, mm^2

  // The noise of one of `count` points along one axis, mm^2.
  double NoiseSquare(double count) const;
};

// The minimiser of the parabola through three scores, over the logarithms of weights and scores.
// Returns the middle weight if the minimum is not between the outer two.
double WeightBetween(const NestedWeight& rougher, const NestedWeight& middle,
                     const NestedWeight& smoother);

// Errors that neighbouring points share, on a surface that is smooth beyond them. Cross-validation
// takes such errors for detail, because a point predicts its neighbours' errors: it is right only
// if errors are independent (Opsomer, Wang & Yang 2001). But the residuals show them. As the weight
// grows fourfold from that of cross-validation, residuals grow slowly while the surface lets go of
// the errors, and at least 3.2 times (as mean squares) as soon as it leaves the surface behind
// them, if that is smooth. Rough surfaces, edges and steps never show such a knee: their residuals
// grow steadily, less than 2.9 times.
struct SharedErrors {
  double weight = kNaN;  // at the knee
  // The errors' mean square per parameter that the surface has at the knee, mm^2 along one axis;
  // for independent errors it is their variance.
  double square_per_parameter = kNaN;
};

// Searches by the score of Craven & Wahba (1979) with the trace from one probe. Each solve starts
// from the last solution and ends when the remaining gain is a given part of the noise's effect on
// the solution.
class NestedWeightSearch {
 public:
  // count: number of points of the solve. part: see above, in 0 .. 1. least_gain: that of the first
  // solve (NestedSolve::Solve).
  NestedWeightSearch(std::size_t count, NestedSolve& solve, double part, double least_gain)
      : count_(static_cast<double>(count)), solve_(solve), part_(part), least_gain_(least_gain) {}

  // Tries weights from smooth to rough by decades until the score rises.
  void Scan();
  // Multiplies and divides the best weight by a factor until neither improves the score.
  void Climb(double factor, double from);
  // Climbs, and also tries a rough weight. Use it after the space was refined: detail that the
  // coarser vertices could not follow looked like noise to them. The rough weight is skipped if the
  // best weight is nearly as rough.
  void ClimbFromRough(double factor, double from);

  // Improves the metric, starting from the best weight. Each step takes the metric in which the
  // present surface bends least and goes beyond it, as long as the score clearly improves.
  void Stretch(double factor);
  // Tries metrics stretched along four directions, for a surface that does not show any detail yet.
  void ScanStretches(double factor);

  // Sets the solve to the best weight, metric and solution.
  NestedWeight Finish();
  // WeightBetween of the best weight and its two neighbours; the best weight if a neighbour is
  // missing.
  double Between() const;
  // Looks for errors that neighbouring points share, beyond the weight `from`, as far as the mean
  // squared residual stays below `most`, mm^2 (class comment of SharedErrors).
  std::optional<SharedErrors> FindSharedErrors(double from, double most);
  // Solves with this weight, more accurately than for comparisons, and makes it the best.
  NestedWeight FinalSolve(double weight);
  // Takes the largest weight at which the misfit of the solve's present solution, a mean square, is
  // still near its least. For a misfit that both rough and smooth surfaces make large.
  NestedWeight SmoothWhileFits(const std::function<double()>& misfit);
  int steps() const { return steps_; }
  double least_gain() const { return least_gain_; }  // for the next search

 private:
  NestedWeight Try(double weight);
  void Take(double weight);
  double SquarePerParameter(const NestedWeight& rougher, const NestedWeight& smoother) const;
  bool IsBetter(const NestedWeight& next) const;
  template <class Search>
  bool TryMetric(const BendingMetric& metric, const Search& search);

  double count_;
  NestedSolve& solve_;
  double part_;
  std::map<double, NestedWeight> tried_;  // with the present metric
  NestedWeight best_;
  NestedSolve::Packed best_solution_;
  double least_gain_;
  int steps_ = 0;
};

}  // namespace semblance::fitting
