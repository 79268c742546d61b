// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit may do to the offsets that make a face's features (thesis 4.3). Whatever the rule,
// they ride along when a coarser level moves.
#pragma once

#include <string_view>
#include <variant>

#include "surfaces/base/fields.h"

namespace semblance {

// They are fitted as any others, and afterwards get back the template's offsets (thesis 4.3).
struct RestoreFeatures {
  static constexpr std::string_view kName = "restore";
};
template <class Visitor>
void Fields(Visitor&, RestoreFeatures&) {}

struct FreeFeatures {
  static constexpr std::string_view kName = "free";
};
template <class Visitor>
void Fields(Visitor&, FreeFeatures&) {}

// They resist moves: as PriorTerm (term.h) from the start of a level's solve, of them alone.
struct WeightedFeatures {
  static constexpr std::string_view kName = "weighted";
  double weight = 1;  // 0 is free; more resists the fit
};
template <class Visitor>
void Fields(Visitor& visit, WeightedFeatures& o) {
  visit(
      FieldInfo{.name = "weight",
                .min = 0,
                .max = 1e6,
                .doc = "factor of the mean over a level's control vertices of the squared move of "
                       "the features'; 0 is free"},
      o.weight);
}

// Their offsets stay to the bit; the other vertices are fitted as if they could not move.
struct FrozenFeatures {
  static constexpr std::string_view kName = "frozen";
};
template <class Visitor>
void Fields(Visitor&, FrozenFeatures&) {}

using FeatureRule = std::variant<RestoreFeatures, FreeFeatures, WeightedFeatures, FrozenFeatures>;

}  // namespace semblance
