// SPDX-License-Identifier: GPL-3.0-or-later
// The triangles around an edge in places, before and after it collapses to a point.
#pragma once

#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

// As EdgePatch, in mm: triangle i was (keep or gone, ring[i], ring[i + 1]) and becomes (place,
// ring[i], ring[i + 1]); that or those at the edge go.
struct PatchPlaces {
  Vec3 keep, gone, place;      // both ends, and where they go
  std::vector<Vec3> opposite;  // the third corners of the one or two triangles at the edge
  std::vector<Vec3> ring;
  std::vector<bool> at_gone;  // the apex of each triangle
  bool closed = false, on_border = false;
  std::vector<Vec3> samples;  // points near the triangles

  const Vec3& RingAfter(std::size_t i) const { return ring[i + 1 < ring.size() ? i + 1 : 0]; }
  const Vec3& ApexBefore(std::size_t i) const { return at_gone[i] ? gone : keep; }
};

}  // namespace semblance
