// SPDX-License-Identifier: GPL-3.0-or-later
// The 256 cases of marching cubes (Lorensen & Cline 1987). One rule for all faces ensures that
// neighbouring cells agree, so that the mesh has no holes: two inside corners that lie diagonally
// on a face are separated.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "surfaces/base/layers.h"

namespace semblance::surfaces {

// An edge of a cell.
struct CellEdge {
  int from, to;  // corners, from < to; corner c lies at (c & 1, c >> 1 & 1, c >> 2 & 1)
  int axis;      // direction, 0, 1 or 2
};
inline constexpr std::array<CellEdge, 12> kCellEdges = {{{0, 1, 0},
                                                         {2, 3, 0},
                                                         {4, 5, 0},
                                                         {6, 7, 0},
                                                         {0, 2, 1},
                                                         {1, 3, 1},
                                                         {4, 6, 1},
                                                         {5, 7, 1},
                                                         {0, 4, 2},
                                                         {1, 5, 2},
                                                         {2, 6, 2},
                                                         {3, 7, 2}}};

// The edge from a corner upward along an axis. The corner must be on the cell's lower side of that
// axis.
constexpr int EdgeFrom(int corner, int axis) {
  int e = 0;
  while (kCellEdges[e].from != corner || kCellEdges[e].axis != axis) {
    ++e;
  }
  return e;
}

// Edges of a cell, as bits.
using EdgeBits = std::uint16_t;
inline constexpr EdgeBits kAllEdges = (1 << 12) - 1;

// The triangles of each case as triples of edges, counter-clockwise seen from outside. Bit c of a
// case is set if corner c is inside. Diagonals in a face of the cell are avoided if possible, so
// that two cells do not share such an edge by accident.
const std::array<std::vector<std::array<std::uint8_t, 3>>, 256>& MarchingCubesCases();

// For each case and each crossed edge, the edges on the same sheet of the surface within the cell,
// including the edge itself. Two sheets in one cell have disjoint sets.
const std::array<std::array<EdgeBits, 12>, 256>& MarchingCubesLoops();

}  // namespace semblance::surfaces
