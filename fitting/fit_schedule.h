// SPDX-License-Identifier: GPL-3.0-or-later
// In which order the levels of an H-spline are fitted, and how much of each solve is kept.
#pragma once

#include <vector>

#include "surfaces/fields.h"

namespace semblance {

// One step of the fit (thesis 4.2): level L is fitted by least squares, and every control vertex
// goes `fraction` of the way to its solution, c + fraction (c' - c).
struct LevelFit {
  int level = 0;
  double fraction = 1;
};
template <class Visitor>
void Fields(Visitor& visit, LevelFit& o) {
  visit(FieldInfo{.name = "level",
                  .min = 0,
                  .max = 12,
                  .doc = "level of the H-spline to fit; 0 is the coarsest"},
        o.level);
  visit(FieldInfo{.name = "fraction",
                  .min = 0,
                  .max = 1,
                  .doc =
                      "part of the way from the old to the solved vertices; less is more cautious"},
        o.fraction);
}

// Thesis 4.4. What is left of a misfit that every level could remove is the product of
// 1 - fraction, 8 % here.
inline std::vector<LevelFit> PublishedSchedule() {
  return {{0, 0.4}, {1, 0.35}, {2, 0.35}, {0, 0.35}, {1, 0.3}, {2, 0.3}};
}

}  // namespace semblance
