// SPDX-License-Identifier: GPL-3.0-or-later
// The option `weight` that every term has.
#pragma once

#include "surfaces/base/fields.h"

namespace semblance {

// Every weight: 0 (the term is off) .. 1e6.
template <class Visitor>
void WeightField(Visitor& visit, double& weight) {
  visit(FieldInfo{.name = "weight",
                  .min = 0,
                  .max = 1e6,
                  .doc = "factor of the mean squared residual; 0 switches the term off"},
        weight);
}

// The same, or `auto`: then each solve chooses it by generalised cross-validation (auto_weight.h).
template <class Visitor>
void AutoWeightField(Visitor& visit, AutoOr<double>& weight) {
  visit(FieldInfo{.name = "weight",
                  .min = 0,
                  .max = 1e6,
                  .doc = "factor of the mean squared residual; 0 switches the term off; auto: "
                         "chosen by generalised cross-validation, for points that are many and "
                         "whose errors are independent"},
        weight);
}

}  // namespace semblance
