// SPDX-License-Identifier: GPL-3.0-or-later
// Rules for the offsets that make a face's features (thesis 4.3). Under every rule the features
// move with the coarser levels.
#pragma once

#include <string_view>
#include <variant>

#include "surfaces/base/fields.h"

namespace semblance::fitting {

// The features' offsets are fitted like all others. After the fit they get back the template's
// offsets (thesis 4.3).
struct RestoreFeatures {
  static constexpr std::string_view kName = "restore";
};
template <class Visitor>
void Fields(Visitor&, RestoreFeatures&) {}

// The features' offsets are fitted like all others.
struct FreeFeatures {
  static constexpr std::string_view kName = "free";
};
template <class Visitor>
void Fields(Visitor&, FreeFeatures&) {}

// A PriorTerm (term.h) over the features alone holds them to their places at the start of a level's
// solve.
struct WeightedFeatures {
  static constexpr std::string_view kName = "weighted";
  double weight = 1;
};
template <class Visitor>
void Fields(Visitor& visit, WeightedFeatures& o) {
  visit(FieldInfo{.name = "weight",
                  .min = 0,
                  .max = 1e6,
                  .doc = "factor of the sum of the features' squared moves over the number of the "
                         "level's control vertices; 0: the features are free"},
        o.weight);
}

// The features' offsets keep their exact bits. The other vertices are fitted as if the features
// could not move.
struct FrozenFeatures {
  static constexpr std::string_view kName = "frozen";
};
template <class Visitor>
void Fields(Visitor&, FrozenFeatures&) {}

using FeatureRule = std::variant<RestoreFeatures, FreeFeatures, WeightedFeatures, FrozenFeatures>;

}  // namespace semblance::fitting
