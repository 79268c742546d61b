// SPDX-License-Identifier: GPL-3.0-or-later
// The connectivity of a manifold triangle mesh, kept in arrays while edges collapse.
#pragma once

#include <cstdint>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Half-edge 4 t + i runs along side i of triangle t, from its corner i to the next; the index
// 4 t + 3 is unused, so that neighbours within a triangle need no division.
using HalfEdgeIndex = std::int32_t;

class HalfEdges {
 public:
  // Throws InputError, naming the caller `who`, if the mesh is not a consistently oriented
  // manifold: an edge with two triangles on one side, or a vertex whose triangles are not a single
  // fan.
  HalfEdges(const TriMesh& mesh, const char* who);

  static HalfEdgeIndex Next(HalfEdgeIndex h) { return (h & 3) == 2 ? h - 2 : h + 1; }
  static HalfEdgeIndex Previous(HalfEdgeIndex h) { return (h & 3) == 0 ? h + 2 : h - 1; }
  static std::int32_t TriangleOf(HalfEdgeIndex h) { return h >> 2; }

  std::int32_t From(HalfEdgeIndex h) const { return sides_[h].from; }
  std::int32_t To(HalfEdgeIndex h) const { return sides_[Next(h)].from; }
  HalfEdgeIndex Twin(HalfEdgeIndex h) const { return sides_[h].twin; }  // -1 on a border
  // The next half-edge that leaves the same vertex, counter-clockwise; -1 after the last at a
  // border. Clockwise likewise.
  HalfEdgeIndex TurnLeft(HalfEdgeIndex h) const { return Twin(Previous(h)); }
  HalfEdgeIndex TurnRight(HalfEdgeIndex h) const { return Twin(h) < 0 ? -1 : Next(Twin(h)); }
  // One index per edge: the lower of its half-edges.
  HalfEdgeIndex EdgeOf(HalfEdgeIndex h) const { return Twin(h) >= 0 && Twin(h) < h ? Twin(h) : h; }

  bool IsOnBorder(std::int32_t v) const { return on_border_[v]; }
  HalfEdgeIndex End() const { return static_cast<HalfEdgeIndex>(sides_.size()); }
  bool IsAlive(HalfEdgeIndex h) const { return sides_[h].from >= 0; }  // false for 4 t + 3
  Triangle Corners(std::int32_t t) const {
    return {sides_[4 * t].from, sides_[4 * t + 1].from, sides_[4 * t + 2].from};
  }

  // Removes the triangles at the edge of h; the others at its end get its start as corner. The
  // caller has checked that a manifold is left. `of_end`: the half-edges that leave the end,
  // without those of the removed triangles.
  void Collapse(HalfEdgeIndex h, const std::vector<HalfEdgeIndex>& of_end);

 private:
  struct Side {
    std::int32_t from = -1;
    HalfEdgeIndex twin = -1;
  };

  void FindTwins(const TriMesh& mesh, const char* who);
  void CheckFans(const TriMesh& mesh, const char* who) const;
  void Remove(HalfEdgeIndex h);

  std::vector<Side> sides_;
  std::vector<bool> on_border_;  // per point; never changes
};

}  // namespace semblance
