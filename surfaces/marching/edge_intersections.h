// SPDX-License-Identifier: GPL-3.0-or-later
// The common parts of the polygonizers: the intersections of a surface with the edges of a grid,
// the march through the grid's layers, and the mesh that marching cubes makes of the intersections.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "surfaces/marching/marching_cubes.h"
#include "surfaces/marching/polygonize.h"

namespace semblance::surfaces {

struct CrossedCell {
  std::int64_t index;          // index of the lowest corner
  std::uint8_t mask;           // bit c: corner c is inside; neither 0 nor 255
  EdgeBits edges = kAllEdges;  // edges whose crossings, if any, belong to the mesh
};

// A grid edge on which the sign changes. id: 3 * (index of the lower corner) + axis.
struct CrossedEdge {
  std::int64_t id;
  double from, to;   // values at the lower and the upper corner
  double at = kNaN;  // crossing, 0..1 along the edge; NaN before the search
};

struct EdgeIntersections {
  std::vector<CrossedCell> cells;  // ascending
  std::vector<CrossedEdge> edges;  // in any order, without repeats
  PolygonizeSummary summary;
};

// CrossedEdge::id of an edge of a cell.
std::int64_t EdgeId(const SampleGrid& grid, const GridIndex& cell, const CellEdge& edge);

// The points of a grid edge: from + t * along, 0 <= t <= 1.
struct EdgeLine {
  Vec3 from, along;

  Vec3 At(double t) const { return from + t * along; }
};
EdgeLine MakeEdgeLine(const SampleGrid& grid, const CrossedEdge& edge);

// Calls visit(edge) for those crossed edges of a cell that belong to the mesh and to no later cell:
// the edges from its lowest corner and, at the upper ends of the grid, others. Each crossed edge is
// visited by exactly one cell.
template <class Visit>
void ForEachOwnEdge(const SampleGrid& grid, const CrossedCell& crossed, const Visit& visit) {
  const GridIndex cell = grid.At(crossed.index);
  for (EdgeBits rest = crossed.edges; rest != 0; rest &= EdgeBits(rest - 1)) {
    const CellEdge& edge = kCellEdges[std::countr_zero(rest)];
    if ((crossed.mask >> edge.from & 1) == (crossed.mask >> edge.to & 1)) {
      continue;
    }
    bool owned_by_next = false;
    for (int axis = 0; axis < 3; ++axis) {
      owned_by_next |= (edge.from >> axis & 1) != 0 && cell[axis] + 2 < grid.counts[axis];
    }
    if (!owned_by_next) {
      visit(edge);
    }
  }
}

// Finds the sign change t of a field on the line 0 <= t <= 1 with the values `from` at 0 and `to`
// at 1. Adds the number of field evaluations to `evaluations`.
double SearchCrossing(double from, double to, const EdgeSearchOptions& options,
                      const std::function<double(double)>& field, std::int64_t& evaluations);

// Builds the mesh, with points in the order of edge ids and triangles in the order of cells.
PolygonizeResult BuildMesh(const SampleGrid& grid, EdgeIntersections intersections);

// Marching cubes layer by layer. Only two layers of corner values are kept (thesis 3.2.1). Values
// start as unknown (NaN). Only requested corners are cleared between layers, so that cells that are
// not visited cost nothing (thesis 3.3).
class SliceMarchingCubes {
 public:
  explicit SliceMarchingCubes(const SampleGrid& grid)
      : grid_(grid),
        lower_(std::size_t(grid.counts[0]) * grid.counts[1], kNaN),
        upper_(lower_.size(), kNaN) {}

  // Makes the upper layer of corners the lower one. The first call makes layer 0 the lower one,
  // with unknown values unless UpperLayer was filled before.
  void NextLayer() {
    std::swap(lower_, upper_);
    std::swap(requested_lower_, requested_upper_);
    for (const std::size_t column : requested_upper_) {
      upper_[column] = kNaN;
    }
    requested_upper_.clear();
    ++slice_;
  }

  // The upper layer, to be filled completely: counts[0] * counts[1] values, i fastest.
  std::span<double> UpperLayer() { return upper_; }

  // Records cell (i, j) between the two layers if the surface crosses it. Its corner values must be
  // known.
  void Cell(int i, int j) {
    Record(i, j, [](CrossedEdge&) {});
  }

  // The same; value(corner) computes unknown values, and search(edge) finds the crossings.
  template <class Value, class Search>
  void Cell(int i, int j, const Value& value, const Search& search) {
    for (int c = 0; c < 8; ++c) {
      const bool upper = (c >> 2 & 1) != 0;
      const GridIndex corner = {i + (c & 1), j + (c >> 1 & 1), slice_ + (upper ? 1 : 0)};
      const std::size_t column = Column(corner[0], corner[1]);
      double& at = (upper ? upper_ : lower_)[column];
      if (std::isnan(at)) {
        at = value(corner);
        (upper ? requested_upper_ : requested_lower_).push_back(column);
        ++intersections_.summary.corner_evaluations;
      }
    }
    Record(i, j, search);
  }

  PolygonizeSummary& Summary() { return intersections_.summary; }

  // Returns the intersections with the cells in ascending order.
  EdgeIntersections Take() {
    std::sort(intersections_.cells.begin(), intersections_.cells.end(),
              [](const CrossedCell& a, const CrossedCell& b) { return a.index < b.index; });
    return std::move(intersections_);
  }

 private:
  std::size_t Column(int i, int j) const { return i + std::size_t(grid_.counts[0]) * j; }
  double At(int i, int j, int c) const {
    return ((c >> 2 & 1) != 0 ? upper_ : lower_)[Column(i + (c & 1), j + (c >> 1 & 1))];
  }

  template <class Search>
  void Record(int i, int j, const Search& search) {
    int mask = 0;
    for (int c = 0; c < 8; ++c) {
      mask |= (At(i, j, c) > 0) << c;
    }
    if (mask == 0 || mask == 255) {
      return;
    }
    const GridIndex cell = {i, j, slice_};
    intersections_.cells.push_back({grid_.Index(cell), static_cast<std::uint8_t>(mask)});
    ForEachOwnEdge(grid_, intersections_.cells.back(), [&](const CellEdge& edge) {
      CrossedEdge crossed{EdgeId(grid_, cell, edge), At(i, j, edge.from), At(i, j, edge.to)};
      search(crossed);
      intersections_.edges.push_back(crossed);
    });
  }

  const SampleGrid& grid_;
  std::vector<double> lower_, upper_;
  std::vector<std::size_t> requested_lower_, requested_upper_;  // columns
  int slice_ = -1;
  EdgeIntersections intersections_;
};

}  // namespace semblance::surfaces
