// SPDX-License-Identifier: GPL-3.0-or-later
// Moving least squares: each vertex gets its own best linear fit to the dowels around it.
#pragma once

#include <string_view>

#include "interp/dowels/depth_input.h"
#include "interp/dowels/dowel_samples.h"

namespace semblance::interp {

struct MovingLeastSquares {
  static constexpr std::string_view kName = "moving_least_squares";
  double width_mm = 25;
  double thin_mm = 3;
  bool clamp = true;
  double max_angle_deg = 90;
};
template <class Visitor>
void Fields(Visitor& visit, MovingLeastSquares& o) {
  visit(FieldInfo{.name = "width_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 1e4,
                  .doc = "a dowel at distance r has the weight exp(-(r/width)^2); less follows the "
                         "dowels more closely and tends to the nearest one, more smooths and tends "
                         "to one linear function"},
        o.width_mm);
  visit(FieldInfo{.name = "thin_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 1e3,
                  .doc = "spread of the weighted dowels in a direction at which half of the slope "
                         "in this direction is kept; a smaller spread keeps less, which makes a "
                         "smooth transition to dowels in a plane, a line or a point"},
        o.thin_mm);
  ClampField(visit, o.clamp);
  MaxAngleField(visit, o.max_angle_deg);
}

// The scheme smooths: it does not interpolate the dowels. Distances are straight. Far from all
// dowels the depth is that of the nearest one. No sd_mm. kNotFacing as in AssignWhereFacing. Throws
// InputError as CheckDepthInput does.
DepthField InterpolateDepth(const MovingLeastSquares& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance::interp
