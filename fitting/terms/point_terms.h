// SPDX-License-Identifier: GPL-3.0-or-later
// The terms that draw a level's surface to the points (term.h).
#pragma once

#include <array>
#include <string_view>

#include "fitting/terms/term_weight.h"

namespace semblance {

enum class RobustLoss { kNone, kHuber, kCauchy, kTukey };
constexpr auto EnumNames(RobustLoss) {
  return std::to_array<std::string_view>({"none", "huber", "cauchy", "tukey"});
}

// The surface meets the points: weight * sum_i w_i rho(|S(u_i,v_i) - p_i|^2) / sum_i w_i, the mean
// over the points by their own weights w_i, mm^2. rho(s) = s without a loss; with a = loss_width_mm
// Huber's is s for s <= a^2, else 2 a sqrt(s) - a^2, Cauchy's a^2 log(1 + s / a^2), and Tukey's
// a^2 / 3 (1 - (1 - s / a^2)^3) for s <= a^2, else a^2 / 3: points beyond a have no pull at all.
struct PointTerm {
  static constexpr std::string_view kName = "points";
  double weight = 1;                    // of the mean squared distance
  RobustLoss loss = RobustLoss::kNone;  // tames points far off
  double loss_width_mm = 5;             // from here on a point counts less
};
template <class Visitor>
void Fields(Visitor& visit, PointTerm& o) {
  WeightField(visit, o.weight);
  visit(FieldInfo{.name = "loss",
                  .doc = "how points far off are tamed: none, huber, cauchy or tukey"},
        o.loss);
  visit(FieldInfo{.name = "loss_width_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 1e3,
                  .doc = "distance from which a robust loss counts a point less"},
        o.loss_width_mm);
}

// The standard landmarks are met for their own sake, in addition to what the points give them and
// however many seeds there are: weight * sum_i w_i |S(u_i,v_i) - p_i|^2 / sum_i w_i over them
// alone, mm^2.
struct LandmarkTerm {
  static constexpr std::string_view kName = "landmarks";
  double weight = 1;  // of the mean squared distance
};
template <class Visitor>
void Fields(Visitor& visit, LandmarkTerm& o) {
  WeightField(visit, o.weight);
}

// The surface stays where a prior holds it for likely: weight * mean over the prior's shape of
// |S(u,v) - x|^2 / sd^2, x and sd those that the prior states there. weight, mm^2, is the cost of
// one standard deviation everywhere: more than the points' mean square is worth following.
struct PriorShapeTerm {
  static constexpr std::string_view kName = "prior_shape";
  double weight = 1;  // of the mean square
};
template <class Visitor>
void Fields(Visitor& visit, PriorShapeTerm& o) {
  WeightField(visit, o.weight);
}

// The surface may slide along itself (tangent-distance minimisation): weight * the mean over the
// points, by their weights, of (n . d)^2 + tangential |d - n (n . d)|^2, mm^2; d = S(u,v) - p and n
// the unit normal at (u,v) of the level's surface before the solve. For points whose (u,v) are only
// about right. With tangential 1, or where there is no normal, as the points without a loss.
struct TangentPointTerm {
  static constexpr std::string_view kName = "tangent_points";
  double weight = 1;        // of the mean squared distance
  double tangential = 0.1;  // along the surface, against its normal
};
template <class Visitor>
void Fields(Visitor& visit, TangentPointTerm& o) {
  WeightField(visit, o.weight);
  visit(FieldInfo{.name = "tangential",
                  .min = 0,
                  .max = 1,
                  .doc = "what a misfit along the surface counts against one along its normal; 0 "
                         "leaves sliding to the other terms"},
        o.tangential);
}

}  // namespace semblance
