// SPDX-License-Identifier: GPL-3.0-or-later
// The terms that look at the bone beneath the points (term.h).
#pragma once

#include <string_view>

#include "fitting/terms/term_weight.h"

namespace semblance {

// Skin outside bone, for points whose foot on the bone is known: weight * mean over them, by their
// weights, of max(0, min_depth_mm - n . (S(u,v) - foot))^2, mm^2; n is the point's direction out of
// the bone. Costs nothing where the surface is far enough out.
struct NonPenetrationTerm {
  static constexpr std::string_view kName = "non_penetration";
  double weight = 1;        // of the mean square
  double min_depth_mm = 2;  // outside bone, along the point's direction
};
template <class Visitor>
void Fields(Visitor& visit, NonPenetrationTerm& o) {
  WeightField(visit, o.weight);
  visit(FieldInfo{.name = "min_depth_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 100,
                  .doc = "how far outside the bone the surface is to be, at least, along the "
                         "point's direction"},
        o.min_depth_mm);
}

// A spring from the foot on the bone to the surface (thesis 5.3): weight * mean over the points
// with a foot, by their weights, of (|S(u,v) - foot| - depth)^2, mm^2. Its length at rest is the
// point's depth, its distance from the foot. Unlike the points it lets the surface swing round the
// foot.
struct SpringTerm {
  static constexpr std::string_view kName = "spring";
  double weight = 0.1;  // of the mean square
};
template <class Visitor>
void Fields(Visitor& visit, SpringTerm& o) {
  WeightField(visit, o.weight);
}

}  // namespace semblance
