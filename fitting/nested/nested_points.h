// SPDX-License-Identifier: GPL-3.0-or-later
// The points of a nested fit, as displacements from where the surface starts.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "fitting/nested/grid_values.h"
#include "fitting/problem/fit_target.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// Sorted along a Z-curve, so that points that follow each other are neighbours; their order as
// given has no effect. Only directions in which some point is off the start are channels: a height
// field over its plane has one.
struct NestedPoints {
  std::vector<double> x, y;      // in patches of level 0
  std::vector<double> weight;    // > 0
  std::vector<double> value[3];  // displacement along each channel's axis, mm
  std::vector<std::uint32_t> given;
  int channels = 0;
  Eigen::Matrix<double, 3, Eigen::Dynamic> axes{3, 0};  // orthonormal, a column per channel

  std::size_t size() const { return x.size(); }
};

NestedPoints DisplacementsFrom(const HSplineSurface& start, const ScatteredPoints& points,
                               int threads);

// A point's patch on a level, by x and y in patches of level 0.
inline std::array<int, 2> PatchOn(const PatchGrid& grid, int level, double x, double y) {
  const double scale = 1 << level;
  return {std::clamp(static_cast<int>(x * scale), 0, grid.patches_u - 1),
          std::clamp(static_cast<int>(y * scale), 0, grid.patches_v - 1)};
}

// The same, and the weights of its vertices along u and v.
struct NestedPlace {
  int i = 0, j = 0;
  std::array<double, 4> along_u, along_v;
};
NestedPlace PlaceOn(const PatchGrid& grid, int level, double x, double y);

}  // namespace semblance
