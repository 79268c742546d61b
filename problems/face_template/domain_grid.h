// SPDX-License-Identifier: GPL-3.0-or-later
// An H-spline through points that are given on a regular grid of its domain.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// columns x rows points (u,v), u fastest, from (0,0) to (1,1).
struct DomainGrid {
  int columns = 0;
  int rows = 0;

  std::size_t size() const { return static_cast<std::size_t>(columns) * rows; }
  Vec2 UvAt(std::size_t k) const {
    return {static_cast<double>(k % columns) / (columns - 1),
            static_cast<double>(k / columns) / (rows - 1)};
  }
  std::size_t NearestTo(const Vec2& uv) const;
};

// At least three samples along each side of a patch of the finest level. Throws InputError for a
// surface that is not open.
DomainGrid GridOf(const HSplineShape& shape);

// The plain B-spline of one level that is closest to the samples, by least squares; mm. On such a
// grid that is the least squares of its columns, then of its rows.
ControlNet NetThrough(const HSplineShape& shape, int level, const DomainGrid& grid,
                      std::span<const Vec3> samples);

// Level 0 is the least-squares fit of the samples; each finer level moves the vertices where its
// own least-squares fit differs by more than tolerance_mm.
HSplineSurface SurfaceThrough(const HSplineShape& shape, const DomainGrid& grid,
                              std::span<const Vec3> samples, double tolerance_mm = 0.02);

}  // namespace semblance
