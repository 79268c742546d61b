// SPDX-License-Identifier: GPL-3.0-or-later
// Moving least squares: at each vertex the linear function that fits the dowels around it best.
#pragma once

#include <string_view>

#include "interp/dowels/depth_input.h"
#include "interp/dowels/dowel_samples.h"

namespace semblance {

struct MovingLeastSquares {
  static constexpr std::string_view kName = "moving_least_squares";
  double width_mm = 25;       // of the weights' Gaussian
  double thin_mm = 3;         // half of the slope is kept at this spread
  bool clamp = true;          // to the dowels' range
  double max_angle_deg = 90;  // further turned bone gets no depth
};
template <class Visitor>
void Fields(Visitor& visit, MovingLeastSquares& o) {
  visit(FieldInfo{.name = "width_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 1e4,
                  .doc = "a dowel at distance r has weight exp(-(r/width)^2); less follows the "
                         "dowels closer and tends to the nearest one, more smooths and tends to "
                         "one linear function"},
        o.width_mm);
  visit(FieldInfo{.name = "thin_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 1e3,
                  .doc = "where the weighted dowels spread by this in a direction, half of the "
                         "slope along it is kept, and less where they are thinner: the smooth "
                         "passage to a lower order where they lie in a plane, a line or a point"},
        o.thin_mm);
  ClampField(visit, o.clamp);
  MaxAngleField(visit, o.max_angle_deg);
}

// Smooths: a dowel's depth is met only as far as its neighbours allow. Distances are straight
// lines. Far from all dowels it is the nearest one's depth. No sd_mm. kNotFacing as
// AssignWhereFacing. Throws InputError as CheckDepthInput.
DepthField InterpolateDepth(const MovingLeastSquares& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance
