// SPDX-License-Identifier: GPL-3.0-or-later
// What a level's solve weighs against each other. Each term costs `weight * mean squared residual`,
// in mm^2 times the weight, so that a weight means the same over levels, point counts and subjects.
// A new term is one struct in a header of its kind, one entry of the variant, and its overloads of
// AddResiduals and TermCost (term_cost.h).
#pragma once

#include <string_view>
#include <variant>

#include "fitting/terms/bone_terms.h"
#include "fitting/terms/point_terms.h"
#include "fitting/terms/surface_terms.h"

namespace semblance {

using Term =
    std::variant<PointTerm, PriorTerm, SmoothnessTerm, MembraneTerm, TangentPointTerm, SymmetryTerm,
                 NonPenetrationTerm, SpringTerm, DistortionTerm, LandmarkTerm, PriorShapeTerm>;

inline std::string_view TermName(const Term& term) {
  return std::visit([](const auto& t) { return t.kName; }, term);
}

inline double WeightOf(const Term& term) {
  return std::visit([](const auto& t) -> double { return t.weight; }, term);
}

}  // namespace semblance
