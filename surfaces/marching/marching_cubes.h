// SPDX-License-Identifier: GPL-3.0-or-later
// The 256 cases of marching cubes (Lorensen & Cline 1987), derived by one rule for all faces so
// that neighbouring cells always agree: on a face with two inside corners across from each other,
// the inside corners are kept apart. The result has no holes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace semblance {

// Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2 & 1).
struct CellEdge {
  int from, to;  // corners, from < to
  int axis;      // 0, 1 or 2: the direction from `from` to `to`
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

// The edge that leaves a corner upward along an axis. The corner is on the cell's lower side there.
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

// The triangles of a case as triples of edges, counter-clockwise seen from outside. Bit c of the
// case is set where corner c is inside. No diagonal of a case lies in a face of the cell where one
// can be avoided, so that cells do not share an edge by accident.
const std::array<std::vector<std::array<std::uint8_t, 3>>, 256>& MarchingCubesCases();

// Of a case, for each edge that is crossed: the edges which its crossing is joined to within the
// cell, itself too. Two sheets of a surface in one cell do not meet in these.
const std::array<std::array<EdgeBits, 12>, 256>& MarchingCubesLoops();

}  // namespace semblance
