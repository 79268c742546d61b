// SPDX-License-Identifier: GPL-3.0-or-later
// Where a surface intersects the edges of a grid, and the mesh that marching cubes makes of it.
#pragma once

#include <bit>
#include <cstdint>
#include <functional>
#include <vector>

#include "surfaces/marching/marching_cubes.h"
#include "surfaces/marching/polygonize.h"

namespace semblance {

struct CrossedCell {
  std::int64_t index;          // of its lowest corner
  std::uint8_t mask;           // bit c: corner c is inside; neither 0 nor 255
  EdgeBits edges = kAllEdges;  // those whose crossings, if any, are the mesh's
};

// A grid edge on which the sign changes. id: three times its lower corner plus its axis.
struct CrossedEdge {
  std::int64_t id;
  double from, to;   // values at its lower and upper corner
  double at = kNaN;  // the crossing as a share of the edge; NaN: still to be searched
};

struct EdgeIntersections {
  std::vector<CrossedCell> cells;  // ascending
  std::vector<CrossedEdge> edges;  // in any order, each once
  PolygonizeSummary summary;
};

// The edge of a cell, as CrossedEdge::id.
std::int64_t EdgeId(const SampleGrid& grid, const GridIndex& cell, const CellEdge& edge);

// A grid edge as from + t along, 0 <= t <= 1.
struct EdgeLine {
  Vec3 from, along;

  Vec3 At(double t) const { return from + t * along; }
};
EdgeLine LineOf(const SampleGrid& grid, const CrossedEdge& edge);

// Calls visit(edge) for the crossed edges of a cell that are the mesh's and that no other cell of
// the grid would name: those from its lowest corner and, where the grid ends, those that have no
// cell of their own.
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

// Where a field changes its sign on a line, 0 <= t <= 1: it is `from` at 0 and `to` at 1. Adds to
// `evaluations`.
double SearchCrossing(double from, double to, const EdgeSearchOptions& options,
                      const std::function<double(double)>& field, std::int64_t& evaluations);

// The mesh: points in the order of the edges' ids, triangles in that of the cells.
PolygonizeResult MeshOf(const SampleGrid& grid, EdgeIntersections intersections);

}  // namespace semblance
