// SPDX-License-Identifier: GPL-3.0-or-later
// Depth as a harmonic function (a membrane) or a biharmonic function (a thin plate) on the skull's
// surface.
#pragma once

#include <string_view>
#include <vector>

#include "interp/dowels/depth_input.h"
#include "interp/on_surface/mesh_spline.h"

namespace semblance::interp {

struct Harmonic {
  static constexpr std::string_view kName = "harmonic";
  double radius_mm = 5;
  double softness = 0;
  double max_angle_deg = 90;
};
template <class Visitor>
void Fields(Visitor& visit, Harmonic& o) {
  visit(
      FieldInfo{
          .name = "radius_mm",
          .unit = "mm",
          .min = 0,
          .max = 100,
          .doc =
              "a dowel prescribes the mean depth of the bone within this radius; with 0 only the "
              "depth at its point, which makes a spike that gets thinner the finer the mesh is"},
      o.radius_mm);
  SoftnessField(visit, o.softness);
  MaxAngleField(visit, o.max_angle_deg);
}

// Minimises the integral of the squared gradient along the surface, with the cotangent Laplacian.
// Each vertex is the mean of its neighbours, like heat at rest. The depth stays within the dowels'
// range and spreads around edges, not through the bone. kOutside on pieces of the skull without a
// dowel; kNotFacing as in AssignWhereFacing; no sd_mm. Throws InputError as CheckDepthInput does,
// or if the skull has no triangle.
DepthField InterpolateDepth(const Harmonic& options, const DepthInput& input,
                            const RunContext& run);

// At dowels that it is not shown, with one factor for all folds (MeshSplineLeftOut).
std::vector<DepthField> InterpolateLeftOut(const Harmonic& options, const DepthInput& input,
                                           const Folds& folds, const RunContext& run);

struct Biharmonic {
  static constexpr std::string_view kName = "biharmonic";
  double softness = 0;
  bool clamp = true;
  double max_angle_deg = 90;
};
template <class Visitor>
void Fields(Visitor& visit, Biharmonic& o) {
  SoftnessField(visit, o.softness);
  ClampField(visit, o.clamp);
  MaxAngleField(visit, o.max_angle_deg);
}

// Minimises the integral of the squared Laplacian along the surface, with the cotangent Laplacian.
// The depth is smooth at the dowels and may leave their range between and beyond them. Solves twice
// per dowel. kOutside on pieces of the skull without a dowel; kNotFacing as in AssignWhereFacing;
// no sd_mm. Throws InputError as CheckDepthInput does, or if the skull has no triangle.
DepthField InterpolateDepth(const Biharmonic& options, const DepthInput& input,
                            const RunContext& run);

// At dowels that it is not shown, with one factor for all folds (MeshSplineLeftOut).
std::vector<DepthField> InterpolateLeftOut(const Biharmonic& options, const DepthInput& input,
                                           const Folds& folds, const RunContext& run);

}  // namespace semblance::interp
