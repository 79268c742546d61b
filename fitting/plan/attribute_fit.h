// SPDX-License-Identifier: GPL-3.0-or-later
// Attributes of points (colours, intensities) as functions over the surface that was fitted to the
// points. Each has the vertices and the smoothness that it needs itself.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fitting/problem/fit_schedule.h"
#include "fitting/solve/surface_sigma.h"
#include "surfaces/base/geometry.h"
#include "surfaces/base/run_context.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

struct AttributeColumn {
  double weight = kNaN;  // weight of the thin-plate energy (length_mm 1), for values of sd 1
  double degrees_of_freedom = kNaN;  // trace of the influence matrix
  double rms = kNaN;                 // root mean square misfit, in the column's own unit
  int vertices = -1;                 // independent control vertices
};

struct AttributeFit {
  std::vector<AttributeColumn> columns;
  // One per column: its x is the value, y and z are 0; offsets are in world axes.
  std::vector<HSplineSurface> surfaces;

  // The values of each column at each uv.
  std::vector<std::vector<double>> At(std::span<const Vec2> uv, int threads) const;
};

// Fits each column as a height over the domain of `surface` by the auto plan (nested_fit.h), which
// chooses vertices, smoothness and, unless the plan keeps them, the column's own outliers. Lengths
// in the domain are those of level 0 of the surface.
//   left_out: ascending indices of points without effect.
// Throws InputError if a column has another size than uv or a number that is not finite, or as
// FitNested if too few points are left; Cancelled.
AttributeFit FitAttributes(const HSplineSurface& surface, const AttributeColumns& points,
                           std::span<const std::uint32_t> left_out, const AutoPlan& plan,
                           const RunContext& context);

}  // namespace semblance::fitting
