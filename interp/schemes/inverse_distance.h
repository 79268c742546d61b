// SPDX-License-Identifier: GPL-3.0-or-later
// Shepard's inverse distance weighting: all dowels everywhere, the near ones the more.
#pragma once

#include <string_view>

#include "interp/dowels/depth_input.h"
#include "interp/on_surface/surface_distance.h"

namespace semblance {

struct InverseDistance {
  static constexpr std::string_view kName = "inverse_distance";
  double power = 3;  // 3, not Shepard's 2, which sags to the mean between dowels
  DowelDistance distance = DowelDistance::kEuclidean;  // or along the bone, which is slower
  double max_angle_deg = 90;                           // further turned bone gets no depth
};
template <class Visitor>
void Fields(Visitor& visit, InverseDistance& o) {
  visit(FieldInfo{.name = "power",
                  .min = 0.5,
                  .max = 16,
                  .doc = "a dowel's weight is its distance to the minus this (Shepard 1968); more "
                         "tends to the nearest dowel, less to the mean; the field is flat at each "
                         "dowel above 1 and has a peak there up to 1"},
        o.power);
  DistanceField(visit, o.distance);
  MaxAngleField(visit, o.max_angle_deg);
}

// Weights by the distance to the bases; at a base, that dowel alone. Always within the dowels'
// range. sd_mm is averaged alike, as if all dowels deviated together; NaN if one of them has none.
// kNotFacing as AssignWhereFacing, kOutside where no dowel is reached along the bone. Throws
// InputError as CheckDepthInput, or if the skull has no triangle to go along.
DepthField InterpolateDepth(const InverseDistance& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance
