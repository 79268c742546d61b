// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/implicit/start_cells.h"

#include <algorithm>
#include <cmath>

#include "surfaces/marching/marching_cubes.h"

namespace semblance {
namespace {

// The emitting point of the shell that lies furthest along a direction; -1 if none emits.
int ExtremePoint(const TriMesh& shell, std::span<const double> depth_mm, const Vec3& direction) {
  int extreme = -1;
  for (int v = 0; v < static_cast<int>(shell.points.size()); ++v) {
    const bool further =
        extreme < 0 || shell.points[v].dot(direction) > shell.points[extreme].dot(direction);
    extreme = std::isfinite(depth_mm[v]) && further ? v : extreme;
  }
  return extreme;
}

// The corner nearest to a point, not on the grid's border.
GridIndex InnerCorner(const SampleGrid& grid, const Vec3& p) {
  GridIndex at;
  for (int a = 0; a < 3; ++a) {
    at[a] = std::clamp(static_cast<int>(std::lround((p[a] - grid.origin[a]) / grid.cell_mm[a])), 1,
                       grid.counts[a] - 2);
  }
  return at;
}

struct LastCrossing {
  bool leaves_grid = false;
  int lower = -1;  // the lower corner, along the axis, of the outermost crossed edge; -1: none
};

// Of the field on a line of corners, going by steps of 1 or -1 along an axis.
LastCrossing FindLastCrossing(const ScalarField& field, const SampleGrid& grid, GridIndex at,
                              int axis, int step) {
  LastCrossing last;
  for (; at[axis] > 0 && at[axis] + 1 < grid.counts[axis]; at[axis] += step) {
    const bool inside = field(grid.Corner(at)) > 0;
    if (last.leaves_grid && !inside) {
      last.lower = step > 0 ? at[axis] - 1 : at[axis];
    }
    last.leaves_grid = inside;
  }
  return last;
}

}  // namespace

SampleGrid GridAround(const TriMesh& shell, double depth_mm, int resolution, double margin) {
  const Box3 box = Bounds(shell);
  SampleGrid grid;
  grid.cell_mm = Vec3::Constant((box.sizes().maxCoeff() + 2 * depth_mm) / resolution);
  grid.origin = box.min() - Vec3::Constant(margin * depth_mm) - 2 * grid.cell_mm;
  for (int axis = 0; axis < 3; ++axis) {
    grid.counts[axis] = static_cast<int>(std::ceil((box.sizes()[axis] + 2 * margin * depth_mm) /
                                                   grid.cell_mm[axis])) +
                        5;
  }
  return grid;
}

bool FindStartCells(const TriMesh& shell, std::span<const double> depth_mm,
                    const ScalarField& field, const SampleGrid& grid,
                    std::vector<StartCell>& starts) {
  constexpr double kOutward = 0.4;  // of the depth: inside the surface
  for (int axis = 0; axis < 3; ++axis) {
    for (const int step : {-1, 1}) {
      const Vec3 direction = step * Vec3::Unit(axis);
      const int extreme = ExtremePoint(shell, depth_mm, direction);
      const Vec3 inside = shell.points[extreme] + kOutward * depth_mm[extreme] * direction;
      GridIndex at = InnerCorner(grid, inside);
      const LastCrossing last = FindLastCrossing(field, grid, at, axis, step);
      if (last.leaves_grid) {
        return false;
      }
      if (last.lower >= 0) {
        at[axis] = last.lower;
        starts.push_back({grid.Index(at), EdgeBits(1 << EdgeFrom(0, axis))});
      }
    }
  }
  return true;
}

}  // namespace semblance
