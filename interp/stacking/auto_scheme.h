// SPDX-License-Identifier: GPL-3.0-or-later
// Depth without choosing a scheme: several are asked for dowels that they are not shown, and are
// averaged by what they are worth there (stacking), or the best of them is taken.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "interp/stacking/single_scheme.h"

namespace semblance {

enum class AutoTakes { kAverage, kBest };
constexpr auto EnumNames(AutoTakes) { return std::to_array<std::string_view>({"average", "best"}); }

struct AutoScheme {
  static constexpr std::string_view kName = "auto";
  std::vector<SingleScheme> schemes = {RadialBasis{}, Kriging{},
                                       Kriging{.covariance = Covariance::kMatern52}};
  AutoTakes takes = AutoTakes::kAverage;  // the average, or the best alone
  double caution = 0;                     // of stacking_weights.h
};
template <class Visitor>
void Fields(Visitor& visit, AutoScheme& o) {
  visit(FieldInfo{.name = "schemes",
                  .min = 1,
                  .doc = "what is chosen among, each with options of its own; the same scheme may "
                         "stand there with several"},
        o.schemes);
  visit(FieldInfo{.name = "takes",
                  .doc = "average: all, with the weights (0 or more, of sum 1) that err least at "
                         "dowels left out; best: the one that errs least there"},
        o.takes);
  visit(FieldInfo{.name = "caution",
                  .min = 0,
                  .max = 1e6,
                  .doc = "of `average`: how strongly the weights are drawn to equal ones; 0: "
                         "not at all, which often leaves one scheme alone"},
        o.caution);
}

// Each dowel is left out by itself, and counts by the inverse square of its distance to the nearest
// other one (none below 0.3 of the mean distance), for bone between dowels is nearer to them than
// they are to each other, and the outermost ones only tell how a scheme extrapolates. Of more than
// 64, the choice is made by 64 that lie far apart.
// A scheme on the surface without a cheaper way (InterpolateLeftOut) is solved eight times at most.
// The depth is the weighted mean of the schemes that have a depth at the vertex; one that has none
// there is continued by the `extend` rule. Where none has one, the status is that of the scheme
// with the most weight. One scheme alone, or a single dowel, which can tell nothing: the first, as
// it is, with its own sd. Otherwise sd_mm is sd_by_distance.h's from the mixture's errors at
// left-out dowels, with weights of the other dowels. A scheme is passed over that cannot be
// judged: one on the network where there is no area, one of which a left-out fold leaves too few
// dowels for its mean's factors. `shares` of the field name the schemes and their weights: of
// schemes of one name, also by the options that are not the defaults (`kriging matern_5_2`). Throws
// as the schemes do.
DepthField InterpolateDepth(const AutoScheme& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance
