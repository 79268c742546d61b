// SPDX-License-Identifier: GPL-3.0-or-later
// The triangles around an edge, which change when it collapses.
#pragma once

#include <vector>

#include "surfaces/mesh/half_edges.h"

namespace semblance {

// An edge from `keep` to `gone` and what is around it: outer triangle i is (apex, ring[i],
// ring[i + 1]) with keep or gone as apex; where the edge collapses to w, it becomes (w, ring[i],
// ring[i + 1]). Closed: the ring goes on from its last to its first.
struct EdgePatch {
  std::int32_t keep = -1, gone = -1;
  HalfEdgeIndex edge = -1;             // from keep to gone
  std::vector<HalfEdgeIndex> spokes;   // of the outer triangles: from the apex to ring[i]
  std::vector<HalfEdgeIndex> of_gone;  // those that leave `gone`
  std::vector<std::int32_t> ring;
  bool closed = false;     // neither end is on a border
  bool on_border = false;  // the edge itself is

  // h: an edge that is on the border if both its ends are. Of one end on the border, that is kept.
  void Gather(const HalfEdges& mesh, HalfEdgeIndex h);

 private:
  void AppendFan(const HalfEdges& mesh, HalfEdgeIndex from, HalfEdgeIndex before);
};

}  // namespace semblance
