// SPDX-License-Identifier: GPL-3.0-or-later
// Further numbers of points that a surface was fitted to (colours, intensities), as functions over
// it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// Numbers of points; all must outlive it.
struct AttributeColumns {
  std::span<const Vec2> uv;                      // in [0,1] x [0,1]
  std::span<const double> weights = {};          // > 0, one per point; or none: all 1
  std::vector<std::span<const double>> columns;  // each with one number per point

  double Weight(std::size_t k) const { return weights.empty() ? 1 : weights[k]; }
};

struct AttributeColumn {
  double weight = kNaN;              // of the thin-plate energy (SmoothnessTerm, length_mm 1)
  double degrees_of_freedom = kNaN;  // trace of the influence matrix
  double rms = kNaN;                 // of what the points are off, in the column's own unit
};

// The same vertices of level 0 and offsets, along the axes, with nothing in them.
HSplineSurface EmptyLike(const HSplineSurface& surface);

// Functions in the very space of the surface: its vertices of level 0 and its offsets.
struct AttributeFit {
  std::vector<AttributeColumn> columns;
  // Column k is the coordinate k % 3 of surface k / 3; offsets along the axes, not in frames.
  std::vector<HSplineSurface> surfaces;

  // Column by column.
  std::vector<std::vector<double>> At(std::span<const Vec2> uv, int threads) const;
};

// The least squares of each column with the thin-plate energy, over the space of `surface`. Each
// weight of the energy that is tried has one factor for all columns, and each column takes the
// weight with the least score of generalised cross-validation (Craven & Wahba 1979), on the scale
// that it has over the surface.
//   left_out: indices of points that do not count, ascending.
// Throws InputError for columns of another size, a number that is not finite, or no point.
AttributeFit FitAttributes(const HSplineSurface& surface, const AttributeColumns& points,
                           std::span<const std::uint32_t> left_out, int threads);

}  // namespace semblance
