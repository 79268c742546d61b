// SPDX-License-Identifier: GPL-3.0-or-later
// The thin-plate weight of a nested fit, and in which lengths it bends, by generalised
// cross-validation.
#pragma once

#include <cstddef>
#include <map>

#include "fitting/nested/nested_solve.h"

namespace semblance {

struct NestedWeight {
  double weight = kNaN;
  double score = kNaN;               // of generalised cross-validation, mm^2 along one axis
  double degrees_of_freedom = kNaN;  // trace of the influence matrix
  double mean_square = kNaN;         // of the residuals along one axis
};

// The weight between the outer two at which a parabola through the three scores is least, over the
// logarithms of weights and scores; the middle one if there is none.
double WeightBetween(const NestedWeight& rougher, const NestedWeight& middle,
                     const NestedWeight& smoother);

// Craven & Wahba (1979), the trace by one probe. Each solve begins where the one before ended and
// goes on until what is left to gain is a part of what chance does to the solution.
class NestedWeightSearch {
 public:
  // count: of the points that the solve has begun with. part: see above, in 0..1.
  // least_gain: of the first solve (Solve).
  NestedWeightSearch(std::size_t count, NestedSolve& solve, double part, double least_gain)
      : count_(static_cast<double>(count)), solve_(solve), part_(part), least_gain_(least_gain) {}

  // From smooth to rough by decades until the score has turned.
  void Scan();
  // Uphill and downhill from a weight, by a factor, until neither is better.
  void Climb(double factor, double from);
  // The same on finer vertices than those that the weight was found for: a rough one is tried too,
  // for detail that the coarser ones could not follow looked like noise to them. Not where the best
  // is nearly as rough: there is no such detail.
  void ClimbAnew(double factor, double from);

  // From the best weight on: lengths in which the surface bends less, as long as they predict
  // plainly better. At every step the surface itself tells them.
  void Stretch(double factor);
  // Where the surface shows nothing of what is there: lengths stretched along four directions.
  void ScanStretches(double factor);

  // Brings the solve to the best weight and lengths.
  NestedWeight Finish();
  // WeightBetween of the best and those beside it; the best, if one of them was not tried.
  double Between() const;
  // Solves with this weight, more exactly than to compare weights, and takes it for the best.
  NestedWeight Settle(double weight);
  int steps() const { return steps_; }
  double least_gain() const { return least_gain_; }  // for the next search

 private:
  NestedWeight Try(double weight);
  bool IsBetter(const NestedWeight& next) const;
  template <class Search>
  bool TryMetric(const BendingMetric& metric, const Search& search);

  double count_;
  NestedSolve& solve_;
  double part_;
  std::map<double, NestedWeight> tried_;  // in the lengths of the solve
  NestedWeight best_;
  NestedSolve::Packed best_solution_;
  double least_gain_;
  int steps_ = 0;
};

}  // namespace semblance
