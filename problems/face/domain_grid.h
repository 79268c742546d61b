// SPDX-License-Identifier: GPL-3.0-or-later
// An H-spline through points that are given on a regular grid of its domain.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance::problems {

// columns x rows points (u,v), u fastest, from (0,0) to (1,1).
struct DomainGrid {
  int columns = 0;
  int rows = 0;

  std::size_t size() const { return static_cast<std::size_t>(columns) * rows; }
  Vec2 UvAt(std::size_t k) const {
    const std::size_t column = k % columns, row = k / columns;
    return {static_cast<double>(column) / (columns - 1), static_cast<double>(row) / (rows - 1)};
  }
  std::size_t NearestTo(const Vec2& uv) const;  // index of the point
  // The bilinear interpolation of values at the points. uv: in [0,1] x [0,1].
  double Interpolate(std::span<const double> values, const Vec2& uv) const;
};

// Three samples along each side of a patch of the finest level, and at least 97 along each side of
// the domain. Throws InputError for a surface that is not open.
DomainGrid MakeDomainGrid(const HSplineShape& shape);

// The least-squares fit of one level's plain B-spline to the samples (mm). On a regular grid it is
// enough to fit the columns and then the rows.
ControlNet NetThrough(const HSplineShape& shape, int level, const DomainGrid& grid,
                      std::span<const Vec3> samples);

// An H-spline through the samples. Level 0 is their least-squares fit. Each finer level moves those
// of its vertices that its own least-squares fit moves by more than tolerance_mm.
HSplineSurface SurfaceThrough(const HSplineShape& shape, const DomainGrid& grid,
                              std::span<const Vec3> samples, double tolerance_mm = 0.02);

}  // namespace semblance::problems
