// SPDX-License-Identifier: GPL-3.0-or-later
// Depth as a thin plate along the skull's surface.
#pragma once

#include <string_view>
#include <vector>

#include "interp/dowels/depth_input.h"
#include "interp/on_surface/mesh_spline.h"

namespace semblance {

struct Biharmonic {
  static constexpr std::string_view kName = "biharmonic";
  double softness = 0;        // 0 honours every dowel
  bool clamp = true;          // to the dowels' range
  double max_angle_deg = 90;  // further turned bone gets no depth
};
template <class Visitor>
void Fields(Visitor& visit, Biharmonic& o) {
  SoftnessField(visit, o.softness);
  ClampField(visit, o.clamp);
  MaxAngleField(visit, o.max_angle_deg);
}

// The least squared Laplacian along the surface, with the cotangent Laplacian: smooth through the
// dowels, may leave their range between and beyond them. Solves twice per dowel. kOutside on pieces
// of the skull that are closest to no dowel; kNotFacing as AssignWhereFacing; no sd_mm. Throws
// InputError as CheckDepthInput, or if the skull has no triangle.
DepthField InterpolateDepth(const Biharmonic& options, const DepthInput& input,
                            const RunContext& run);

// At dowels that it is not shown, with one factor for all folds (MeshSplineLeftOut).
std::vector<DepthField> InterpolateLeftOut(const Biharmonic& options, const DepthInput& input,
                                           const Folds& folds, const RunContext& run);

}  // namespace semblance
