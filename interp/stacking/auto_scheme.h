// SPDX-License-Identifier: GPL-3.0-or-later
// Depth without the choice of a scheme: several schemes predict left-out dowels and are averaged by
// their errors there (stacking), or the best of them is used.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "interp/stacking/single_scheme.h"

namespace semblance::interp {

enum class AutoTakes { kAverage, kBest };
constexpr auto EnumNames(AutoTakes) { return std::to_array<std::string_view>({"average", "best"}); }

struct AutoScheme {
  static constexpr std::string_view kName = "auto";
  std::vector<SingleScheme> schemes = {RadialBasis{}, Kriging{},
                                       Kriging{.covariance = Covariance::kMatern52}};
  AutoTakes takes = AutoTakes::kAverage;
  double caution = 0;
};
template <class Visitor>
void Fields(Visitor& visit, AutoScheme& o) {
  visit(FieldInfo{.name = "schemes",
                  .min = 1,
                  .doc = "candidate schemes, each with its own options; a scheme may appear "
                         "several times with different options"},
        o.schemes);
  visit(FieldInfo{.name = "takes",
                  .doc =
                      "average: all schemes, with the weights (>= 0, sum 1) that have the smallest "
                      "error at left-out dowels; best: the scheme with the smallest error"},
        o.takes);
  visit(FieldInfo{.name = "caution",
                  .min = 0,
                  .max = 1e6,
                  .doc = "for `average`: strength of the pull towards equal weights; 0: none, "
                         "which often leaves one scheme alone"},
        o.caution);
}

// Each dowel is left out in turn. Its error is weighted by the inverse square of its distance to
// the nearest other dowel (at least 0.3 of the mean distance), because bone between dowels is
// nearer to them than they are to each other, and because the outermost dowels measure only
// extrapolation. At most 64 dowels, which lie far apart, decide. A scheme on the surface without
// InterpolateLeftOut is solved at most eight times. The depth is the weighted mean of the schemes.
// A scheme without a depth at a vertex is continued by the `extend` rule, if another scheme has a
// depth there; otherwise the status is that of the scheme with the largest weight. sd_mm is
// SdByDistance, fitted to the mixture's errors at left-out dowels with weights from the other
// dowels. With a single scheme or a single dowel the result is the first scheme's, with its own sd.
// A scheme is skipped if it cannot be tested: a scheme on the network without an area, or with too
// few dowels left for its mean's factors. `shares` lists the schemes and weights; schemes of the
// same name are distinguished by the options that differ from the defaults (`kriging matern_5_2`).
// Throws as the schemes do.
DepthField InterpolateDepth(const AutoScheme& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance::interp
