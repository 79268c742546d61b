// SPDX-License-Identifier: GPL-3.0-or-later
// The depth of the nearest dowel: the plainest scheme that knows of place.
#pragma once

#include <string_view>

#include "interp/dowels/depth_input.h"
#include "interp/on_surface/surface_distance.h"

namespace semblance {

struct Nearest {
  static constexpr std::string_view kName = "nearest";
  DowelDistance distance = DowelDistance::kEuclidean;  // or along the bone
  double max_angle_deg = 90;                           // further turned bone gets no depth
};
template <class Visitor>
void Fields(Visitor& visit, Nearest& o) {
  DistanceField(visit, o.distance);
  MaxAngleField(visit, o.max_angle_deg);
}

// Depth and sd_mm of the dowel whose base is nearest; of equally near ones, the first by site name.
// kNotFacing, without depth, where the vertex turns away from that dowel; kOutside where none is
// reached along the bone. Throws InputError as CheckDepthInput, or if the skull has no triangle to
// go along.
DepthField InterpolateDepth(const Nearest& options, const DepthInput& input, const RunContext& run);

}  // namespace semblance
