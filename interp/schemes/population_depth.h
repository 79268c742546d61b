// SPDX-License-Identifier: GPL-3.0-or-later
// Depth as people have it, given the dowels: the mean and the spread of 54 adults all over the
// facial bone, conditioned on a person's own depths.
#pragma once

#include <string_view>

#include "interp/dowels/depth_input.h"

namespace semblance::interp {

struct PopulationDepth {
  static constexpr std::string_view kName = "population";
  double range_mm = 20;
  double error = 0.1;
  double reach_mm = 15;
  double max_angle_deg = 90;
};
template <class Visitor>
void Fields(Visitor& visit, PopulationDepth& o) {
  visit(
      FieldInfo{.name = "range_mm",
                .unit = "mm",
                .min = 1,
                .max = 1e3,
                .doc = "correlation length (Matern 3/2) of what is left of a person's depth when "
                       "people's mean and his build are taken out; more lets a dowel act further"},
      o.range_mm);
  visit(FieldInfo{.name = "error",
                  .min = 0.001,
                  .max = 1,
                  .doc = "standard deviation of a dowel's depth as a share of it, because a "
                         "landmark stands a few mm from the place that its depth is known for"},
        o.error);
  visit(FieldInfo{.name = "reach_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 1e3,
                  .doc = "bone this far from all people's points, such as the back of the head, "
                         "goes over to radial_basis, and has gone over at twice the distance"},
        o.reach_mm);
  MaxAngleField(visit, o.max_angle_deg);
}

// The logarithm of depth is a Gaussian process whose mean, deviation and loading on build are
// people's (CarryToSubject), and whose dowels are known up to `error` and their own sd_mm
// (docs/explanation/mathematics-depth.md). Depth counts from the bone; where the skull was filled,
// the gap is taken off, down to half of radial_basis's depth, so that tissue over the temporal
// fossa has its own depth. sd_mm is the process's where people reach, and NaN beyond. Depths are
// above a tenth of the smallest dowel's and may leave the dowels' range. If CarryToSubject finds a
// fault, the field is radial_basis's, with a note and a share. kNotFacing as in AssignWhereFacing.
// Throws InputError as CheckDepthInput does, or if the skull has no triangle.
DepthField InterpolateDepth(const PopulationDepth& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance::interp
