// SPDX-License-Identifier: GPL-3.0-or-later
// Attributes of points (colours, intensities) as functions over the surface that was fitted to the
// points.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

// Attributes of points as columns. The referenced arrays must outlive it.
struct AttributeColumns {
  std::span<const Vec2> uv;                      // in [0,1] x [0,1]
  std::span<const double> weights = {};          // > 0, one per point; empty: all 1
  std::vector<std::span<const double>> columns;  // each with one number per point

  double Weight(std::size_t k) const { return weights.empty() ? 1 : weights[k]; }
};

struct AttributeColumn {
  double weight = kNaN;              // weight of the thin-plate energy (length_mm 1)
  double degrees_of_freedom = kNaN;  // trace of the influence matrix
  double rms = kNaN;                 // root mean square misfit, in the column's own unit
};

// A surface with the same vertices and edited offsets, all of them zero, and offsets in world axes.
HSplineSurface EmptyLike(const HSplineSurface& surface);

// Functions in the space of the surface: its vertices of level 0 and its edited vertices.
struct AttributeFit {
  std::vector<AttributeColumn> columns;
  // Column k is the coordinate k % 3 of surface k / 3; offsets are in world axes.
  std::vector<HSplineSurface> surfaces;

  // The values of each column at each uv.
  std::vector<std::vector<double>> At(std::span<const Vec2> uv, int threads) const;
};

// Fits each column by least squares with the thin-plate energy, over the space of `surface`. Each
// column uses the weight of the energy with the least score of generalised cross-validation (Craven
// & Wahba 1979). All columns share one factor per tried weight.
//   left_out: ascending indices of points without effect.
// Throws InputError if a column has another size than uv or a number that is not finite, or if no
// point is left.
AttributeFit FitAttributes(const HSplineSurface& surface, const AttributeColumns& points,
                           std::span<const std::uint32_t> left_out, int threads);

}  // namespace semblance::fitting
