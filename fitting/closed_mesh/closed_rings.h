// SPDX-License-Identifier: GPL-3.0-or-later
// A closed mesh taken apart vertex by vertex down to a tetrahedron, and put together again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// The neighbours of a vertex, counter-clockwise seen from outside; each once.
using Ring = std::vector<std::int32_t>;

// A vertex taken out of its ring, whose hole the triangles of the ring's first vertex close.
struct Removal {
  std::int32_t vertex = -1;
  Ring ring;
};

struct ClosedRings {
  std::vector<Ring> rings;  // per vertex; empty of one that is removed
  std::vector<Removal> removals = {};
  std::vector<std::size_t> rounds = {};  // how many removals there were before each round
};

// The rings of a mesh, each from its least vertex on. Throws InputError if the mesh is no manifold.
//   mesh: closed, every point used.
std::vector<Ring> RingsOf(const TriMesh& mesh);

// In rounds, until four vertices are left. In a round no two neighbours go, and those that matter
// least to the shape go first (quadrics of Garland & Heckbert 1997), about a quarter of all. So a
// round leaves a mesh that is coarser everywhere, and has long thin parts as long as vertices last.
//   mesh: one piece without handles and borders, more than three points, every point used.
ClosedRings TakeApart(const TriMesh& mesh);

// Undoes a removal; the later ones have been undone.
void PutBack(const Removal& removal, std::vector<Ring>& rings);

}  // namespace semblance
