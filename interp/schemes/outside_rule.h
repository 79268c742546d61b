// SPDX-License-Identifier: GPL-3.0-or-later
// The depth of vertices to which the scheme gave none: outside the network, or on bone that faces
// away from it. The thesis gives them supraglabella's (4.2).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "interp/dowels/depth_input.h"

namespace semblance {

// Continues the network outwards: the depth at the closest point of the network's triangles,
// blended smoothly to the site's depth. Let s be the dowels' mean depth: up to the distance s from
// the triangles all is the network's, from s + blend_mm on all is the site's. So nothing changes
// where bone merely bulges off its triangle. A network without an area is infinitely far away.
struct ExtendNetwork {
  static constexpr std::string_view kName = "extend";
  double blend_mm = 60;     // over which the network's depth turns into the site's
  std::string site = "sg";  // without a dowel there: the mean depth of all dowels, and reported
};
template <class Visitor>
void Fields(Visitor& visit, ExtendNetwork& o) {
  visit(
      FieldInfo{.name = "blend_mm",
                .unit = "mm",
                .min = 0,
                .max = 1e3,
                .doc = "length over which the network's depth turns into the site's, counted from "
                       "one mean depth off the network; 0: at once"},
      o.blend_mm);
  visit(
      FieldInfo{.name = "site",
                .doc = "landmark whose depth holds far away; without a dowel there, the mean depth "
                       "of all dowels"},
      o.site);
}

// One depth for all of them.
struct ConstantDepth {
  static constexpr std::string_view kName = "constant";
  std::string site = "sg";  // without a dowel there: the mean depth of all dowels, and reported
  std::optional<double> depth_mm = std::nullopt;  // used instead of the site's where given
};
template <class Visitor>
void Fields(Visitor& visit, ConstantDepth& o) {
  visit(
      FieldInfo{.name = "site",
                .doc = "landmark whose depth is used (thesis 4.2: supraglabella); without a dowel "
                       "there, the mean depth of all dowels"},
      o.site);
  visit(FieldInfo{.name = "depth_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 100,
                  .doc = "depth to use instead of the site's"},
        o.depth_mm);
}

// None: such a vertex does not emit.
struct LeaveUnassigned {
  static constexpr std::string_view kName = "unassigned";
};
template <class Visitor>
void Fields(Visitor&, LeaveUnassigned&) {}

using OutsideRule = std::variant<ExtendNetwork, ConstantDepth, LeaveUnassigned>;

// The field with depth_mm and sd_mm set at every vertex that is not kAssigned; all else, also the
// status, is unchanged. sd_mm follows the depth where it is a dowel's or between dowels', else NaN.
// Reports through `run` (step "outside rule") if the site has no dowel. Throws InputError as
// CheckDepthInput, or if the field is not one entry per vertex; Cancelled if stopped.
DepthField ApplyOutsideRule(const OutsideRule& rule, const DepthInput& input, DepthField field,
                            const RunContext& run);

}  // namespace semblance
