// SPDX-License-Identifier: GPL-3.0-or-later
// The options that all Gaussian processes of depths have.
#pragma once

#include <cmath>

#include "surfaces/base/fields.h"

namespace semblance {

template <class Visitor>
void LengthPriorFields(Visitor& visit, double& median_mm, double& spread) {
  visit(FieldInfo{.name = "length_prior_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 1e4,
                  .doc = "median of the length's log-normal prior; a few dozen dowels alone hardly "
                         "determine a length, and their likelihood drifts to either end"},
        median_mm);
  visit(FieldInfo{.name = "length_prior_spread",
                  .min = 1e-3,
                  .max = 10,
                  .doc = "standard deviation of the length's logarithm in the prior: 0.5 means "
                         "within a factor of 2.7 of the median with 95 %; large: likelihood alone"},
        spread);
}

template <class Visitor, class Signal>
void SignalField(Visitor& visit, Signal& signal_mm) {
  visit(FieldInfo{.name = "signal_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 1e3,
                  .doc = "standard deviation of the depth around its mean, alike all over the "
                         "skull; none: by maximum likelihood"},
        signal_mm);
}

template <class Visitor>
void NuggetShareField(Visitor& visit, double& share) {
  visit(FieldInfo{.name = "nugget_share",
                  .min = 0,
                  .max = 10,
                  .doc = "a dowel's depth is taken as uncertain by this times its sd_mm (none: "
                         "certain); 0 honours every dowel, more smooths"},
        share);
}

// The variance of a dowel's depth by that option.
inline double Nugget_mm2(double nugget_share, double sd_mm) {
  const double nugget_mm = nugget_share * sd_mm;
  return std::isfinite(nugget_mm) ? nugget_mm * nugget_mm : 0;
}

template <class Visitor>
void StateSdField(Visitor& visit, bool& state_sd) {
  visit(FieldInfo{.name = "state_sd",
                  .doc = "give sd_mm at each vertex; costs the square of the number of dowels per "
                         "vertex"},
        state_sd);
}

}  // namespace semblance
