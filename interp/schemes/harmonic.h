// SPDX-License-Identifier: GPL-3.0-or-later
// Depth that spreads over the skull's surface like heat that has come to rest.
#pragma once

#include <string_view>
#include <vector>

#include "interp/dowels/depth_input.h"
#include "interp/on_surface/mesh_spline.h"

namespace semblance {

struct Harmonic {
  static constexpr std::string_view kName = "harmonic";
  double radius_mm = 5;       // of the bone whose mean a dowel sets; at 0 it is a spike
  double softness = 0;        // 0 honours every dowel
  double max_angle_deg = 90;  // further turned bone gets no depth
};
template <class Visitor>
void Fields(Visitor& visit, Harmonic& o) {
  visit(
      FieldInfo{.name = "radius_mm",
                .unit = "mm",
                .min = 0,
                .max = 100,
                .doc = "a dowel's depth is the mean depth of the bone so near to it; at 0 it holds "
                       "in its point alone, and the field is a spike there that becomes the "
                       "thinner the finer the mesh is"},
      o.radius_mm);
  SoftnessField(visit, o.softness);
  MaxAngleField(visit, o.max_angle_deg);
}

// The least squared gradient along the surface, with the cotangent Laplacian: each vertex the mean
// of those around it. Within the dowels' range, reaches around edges and not through the bone.
// kOutside on pieces of the skull that are closest to no dowel; kNotFacing as AssignWhereFacing; no
// sd_mm. Throws InputError as CheckDepthInput, or if the skull has no triangle.
DepthField InterpolateDepth(const Harmonic& options, const DepthInput& input,
                            const RunContext& run);

// At dowels that it is not shown, with one factor for all folds (MeshSplineLeftOut).
std::vector<DepthField> InterpolateLeftOut(const Harmonic& options, const DepthInput& input,
                                           const Folds& folds, const RunContext& run);

}  // namespace semblance
