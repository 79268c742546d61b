// SPDX-License-Identifier: GPL-3.0-or-later
// The simplest schemes in space: the mean of all dowels, the nearest dowel, and inverse distance
// weighting.
#pragma once

#include <span>
#include <string_view>

#include "interp/dowels/depth_input.h"
#include "interp/on_surface/surface_distance.h"

namespace semblance::interp {

// One depth for the whole skull: the scheme that all others must beat.
struct Mean {
  static constexpr std::string_view kName = "mean";
};
template <class Visitor>
void Fields(Visitor&, Mean&) {}

// Gives every vertex the mean depth of all dowels, whatever its direction; no sd_mm. Throws
// InputError as CheckDepthInput does.
DepthField InterpolateDepth(const Mean& options, const DepthInput& input, const RunContext& run);

// The mean depth, mm. Needs at least one dowel.
double MeanDepth(std::span<const Dowel> dowels);

// The depth of the nearest dowel.
struct Nearest {
  static constexpr std::string_view kName = "nearest";
  DowelDistance distance = DowelDistance::kEuclidean;
  double max_angle_deg = 90;
};
template <class Visitor>
void Fields(Visitor& visit, Nearest& o) {
  DistanceField(visit, o.distance);
  MaxAngleField(visit, o.max_angle_deg);
}

// Gives each vertex the depth and sd_mm of the dowel with the nearest base; on a tie, the first by
// site name. kNotFacing, without depth, if the vertex turns away from that dowel; kOutside if no
// dowel can be reached along the bone. Throws InputError as CheckDepthInput does, or if geodesic
// distances are requested and the skull has no triangle.
DepthField InterpolateDepth(const Nearest& options, const DepthInput& input, const RunContext& run);

// Shepard's inverse distance weighting: all dowels everywhere, weighted by nearness.
struct InverseDistance {
  static constexpr std::string_view kName = "inverse_distance";
  double power = 3;  // Shepard's 2 sags to the mean between dowels
  DowelDistance distance = DowelDistance::kEuclidean;
  double max_angle_deg = 90;
};
template <class Visitor>
void Fields(Visitor& visit, InverseDistance& o) {
  visit(FieldInfo{.name = "power",
                  .min = 0.5,
                  .max = 16,
                  .doc = "a dowel's weight is distance^-power (Shepard 1968); more tends to the "
                         "nearest dowel, less to the mean; above 1 the field is flat at each "
                         "dowel, up to 1 it has a peak there"},
        o.power);
  DistanceField(visit, o.distance);
  MaxAngleField(visit, o.max_angle_deg);
}

// Weights dowels by the distance to their bases; at a base only that dowel counts. The depth is
// always within the dowels' range. sd_mm is averaged with the same weights, which assumes fully
// correlated errors; NaN if a dowel has none. kNotFacing as in AssignWhereFacing; kOutside if no
// dowel can be reached along the bone. Throws InputError as CheckDepthInput does, or if geodesic
// distances are requested and the skull has no triangle.
DepthField InterpolateDepth(const InverseDistance& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance::interp
