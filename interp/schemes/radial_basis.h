// SPDX-License-Identifier: GPL-3.0-or-later
// Radial basis functions in space: one function per dowel plus a low-degree polynomial, through all
// dowels.
#pragma once

#include <array>
#include <string_view>

#include "interp/dowels/depth_input.h"
#include "interp/dowels/dowel_samples.h"

namespace semblance::interp {

enum class RadialKernel { kLinear, kCubic, kGaussian, kWendlandC2 };
constexpr auto EnumNames(RadialKernel) {
  return std::to_array<std::string_view>({"linear", "cubic", "gaussian", "wendland_c2"});
}

struct RadialBasis {
  static constexpr std::string_view kName = "radial_basis";
  RadialKernel kernel = RadialKernel::kLinear;  // needs no width and does not oscillate
  double width_mm = 80;
  int tail_degree = 1;
  double smoothing = 0;
  bool clamp = true;
  double max_angle_deg = 90;
};
template <class Visitor>
void Fields(Visitor& visit, RadialBasis& o) {
  visit(
      FieldInfo{.name = "kernel",
                .doc =
                    "function of the distance r between dowel and vertex: r (linear), r^3 (cubic), "
                    "exp(-(r/width)^2) (gaussian), or Wendland's compact C2 function, 0 from r = "
                    "width on; r^2 log r is not among them, as it is right in the plane only"},
      o.kernel);
  visit(FieldInfo{.name = "width_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 1e4,
                  .doc = "width of the kernels gaussian and wendland_c2; below the dowels' "
                         "distances the field falls to the tail between them, far above it the "
                         "gaussian oscillates; linear and cubic have none"},
        o.width_mm);
  visit(FieldInfo{.name = "tail_degree",
                  .min = 0,
                  .max = 1,
                  .doc = "polynomial added to the kernels: 0 a constant, 1 linear in space, then a "
                         "linear depth is reproduced; cubic always uses 1, without which its "
                         "equations need not have a solution"},
        o.tail_degree);
  visit(FieldInfo{.name = "smoothing",
                  .min = 0,
                  .max = 1e6,
                  .doc = "added to the kernel matrix's diagonal, where lengths are in units of the "
                         "dowels' rms distance from their centre; 0 honours every dowel, more "
                         "tends to the tail alone"},
        o.smoothing);
  ClampField(visit, o.clamp);
  MaxAngleField(visit, o.max_angle_deg);
}

// Distances between bases and vertices are straight. A linear tail uses only the directions in
// which the dowels spread, because dowels in one plane or line do not determine the others. No
// sd_mm. kNotFacing as in AssignWhereFacing. Throws InputError as CheckDepthInput does, or if the
// equations have no finite solution.
DepthField InterpolateDepth(const RadialBasis& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance::interp
