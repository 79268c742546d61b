// SPDX-License-Identifier: GPL-3.0-or-later
// The depth of vertices without a depth from the scheme: outside the network, or on bone that faces
// away from it. The thesis gives them the depth of supraglabella (4.2).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "interp/dowels/depth_input.h"

namespace semblance::interp {

// Continues the network outwards by the depth at the closest point of its triangles, with a smooth
// transition to a site's depth. Let s be the dowels' mean depth. Up to the distance s from the
// triangles the depth is the network's, so that bone that bulges off its triangle keeps it. From s
// + blend_mm on, it is the site's. A network without areas counts as infinitely far away.
struct ExtendNetwork {
  static constexpr std::string_view kName = "extend";
  double blend_mm = 60;
  std::string site = "sg";
};
template <class Visitor>
void Fields(Visitor& visit, ExtendNetwork& o) {
  visit(FieldInfo{.name = "blend_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 1e3,
                  .doc = "length of the transition from the network's depth to the site's, which "
                         "starts one mean depth off the network; 0: abrupt"},
        o.blend_mm);
  visit(FieldInfo{.name = "site",
                  .doc = "landmark whose depth is used far away; without a dowel there, the mean "
                         "depth of all dowels"},
        o.site);
}

// Gives all these vertices one depth.
struct ConstantDepth {
  static constexpr std::string_view kName = "constant";
  std::string site = "sg";
  std::optional<double> depth_mm = std::nullopt;
};
template <class Visitor>
void Fields(Visitor& visit, ConstantDepth& o) {
  visit(FieldInfo{.name = "site",
                  .doc = "landmark whose depth is used (thesis 4.2: supraglabella); without a "
                         "dowel there, the mean depth of all dowels"},
        o.site);
  visit(FieldInfo{.name = "depth_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 100,
                  .doc = "depth to use instead of the site's"},
        o.depth_mm);
}

// Gives these vertices no depth, so that they do not emit.
struct LeaveUnassigned {
  static constexpr std::string_view kName = "unassigned";
};
template <class Visitor>
void Fields(Visitor&, LeaveUnassigned&) {}

using OutsideRule = std::variant<ExtendNetwork, ConstantDepth, LeaveUnassigned>;

// Sets depth_mm and sd_mm at every vertex that is not kAssigned, and leaves all else, also the
// status, unchanged. sd_mm is the dowels' where the depth comes from dowels, otherwise NaN. Reports
// through `run` (step "outside rule") if the site has no dowel. Throws InputError as
// CheckDepthInput does, or if the field does not have one entry per vertex; Cancelled if stopped.
DepthField ApplyOutsideRule(const OutsideRule& rule, const DepthInput& input, DepthField field,
                            const RunContext& run);

}  // namespace semblance::interp
