// SPDX-License-Identifier: GPL-3.0-or-later
// The collapse of one edge to a point: the triangles that it changes, their quality, and the
// distance by which they move.
#pragma once

#include <cstdint>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/mesh/half_edge_mesh.h"

namespace semblance::surfaces {

// The triangles around an edge from `keep` to `gone`. Outer triangle i is (apex, ring[i],
// ring[i + 1]); its apex is keep or gone, and after the collapse the merged vertex. The one or two
// triangles at the edge itself disappear. All vertices are indices in the half-edge mesh.
struct EdgeNeighbourhood {
  std::int32_t keep = -1, gone = -1;
  OpenMesh::HalfedgeHandle edge;    // from keep to gone; it has a face
  std::vector<std::int32_t> inner;  // the faces of the triangles at the edge
  std::vector<std::int32_t> outer;  // the faces of the outer triangles
  std::vector<bool> at_gone;        // per outer triangle: whether its apex is gone
  std::vector<std::int32_t> ring;   // counter-clockwise
  bool closed = false;     // keep is not on a border: the ring's last vertex meets its first
  bool on_border = false;  // the edge itself is on a border

  // h: a half-edge from keep to gone. If gone is on a border, keep is too and so is the edge; then
  // h has a face.
  void Gather(const HalfEdgeMesh& mesh, OpenMesh::HalfedgeHandle h);

 private:
  void AppendFan(const HalfEdgeMesh& mesh, OpenMesh::HalfedgeHandle from,
                 OpenMesh::HalfedgeHandle before);
};

// The positions of an EdgeNeighbourhood, in mm: triangle i was (keep or gone, ring[i], ring[i + 1])
// and becomes (target, ring[i], ring[i + 1]).
struct CollapseGeometry {
  Vec3 keep, gone, target;     // both ends, and where they merge
  std::vector<Vec3> opposite;  // third corners of the one or two triangles at the edge
  std::vector<Vec3> ring;
  std::vector<bool> at_gone;  // true if the apex of triangle i was gone
  bool closed = false, on_border = false;
  std::vector<Vec3> samples;  // points near the triangles

  const Vec3& RingAfter(std::size_t i) const { return ring[i + 1 < ring.size() ? i + 1 : 0]; }
  const Vec3& ApexBefore(std::size_t i) const { return at_gone[i] ? gone : keep; }
};

// True if no triangle turns by more than 60 degrees and no needle appears: the least 4 sqrt(3) area
// / (sum of squared sides) of the new triangles is at least 0.05, or no less than that of the old
// ones. A triangle without area has no normal and takes the mean normal of all.
bool PreservesQuality(const CollapseGeometry& collapse);

// The sum of the new triangles' area vectors, mm^2.
Vec3 AreaVectorAfter(const CollapseGeometry& collapse);

struct CollapseError {
  // A bound on the distance between the sheets of triangles before and after. It is their largest
  // difference in height over a common plane, which occurs where an edge ends or crosses an edge of
  // the other sheet (Cohen, Manocha & Olano 1997). If the sheets are no height fields, the bound is
  // the distance by which the ends move.
  double sheets_mm = kNaN;
  std::vector<int> triangle_of;     // per sample: its new triangle
  std::vector<double> distance_mm;  // per sample: a bound on the distance from that triangle
};

// Overwrites `error` and reuses its memory.
void MeasureCollapse(const CollapseGeometry& collapse, CollapseError& error);

}  // namespace semblance::surfaces
