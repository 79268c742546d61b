// SPDX-License-Identifier: GPL-3.0-or-later
// The four edges of an H-spline: places along them, the patches beside them, and how two surfaces
// meet along one.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// u = 0, u = 1, v = 0, v = 1.
enum class SurfaceEdge { kU0, kU1, kV0, kV1 };
constexpr auto EnumNames(SurfaceEdge) {
  return std::to_array<std::string_view>({"u0", "u1", "v0", "v1"});
}
std::string_view NameOf(SurfaceEdge edge);

constexpr bool RunsAlongV(SurfaceEdge edge) {
  return edge == SurfaceEdge::kU0 || edge == SurfaceEdge::kU1;
}

// t: in [0,1], the edge's free parameter: v along u0 and u1, u along v0 and v1.
Vec2 OnEdge(SurfaceEdge edge, double t);

// A surface that goes round in u has no border at u = 0 and u = 1, and closed ones at v = 0 and 1;
// one that goes round both ways has none.
bool HasEdge(const HSplineShape& shape, SurfaceEdge edge);
bool IsClosedAlong(const HSplineShape& shape, SurfaceEdge edge);

// Of level 0, along an edge.
int PatchesAlong(const HSplineShape& shape, SurfaceEdge edge);

// A patch beside an edge: t in [index, index + 1] / (patches of level 0 along it * 2^level). The
// edge's curve is one cubic there.
struct EdgeSpan {
  int level = -1;
  int index = -1;
  bool operator==(const EdgeSpan&) const = default;

  double Begin(int patches) const { return index / (static_cast<double>(patches) * (1 << level)); }
  double End(int patches) const { return EdgeSpan{level, index + 1}.Begin(patches); }
};

// The leaves of the surface's patch tree (patch_tree.h) beside an edge, from t = 0 to 1.
std::vector<EdgeSpan> SpansAlong(const HSplineSurface& surface, SurfaceEdge edge);

// Two surfaces at one place of an edge that they share.
struct EdgeMeeting {
  double t = kNaN;          // along the first one's edge
  double gap_mm = kNaN;     // between them
  double angle_deg = kNaN;  // between their tangent planes, 0..90, whichever way their normals
                            // look; NaN where one has none
};

struct EdgeOfSurface {
  const HSplineSurface& surface;
  SurfaceEdge edge = SurfaceEdge::kU0;
};
struct EdgeComparison {
  bool reversed = false;  // the second edge's t runs against the first one's
  int places = 1000;      // > 0: fractions of the golden ratio, which no knot is likely to meet
};
// In ascending t. Both surfaces must have their edges.
std::vector<EdgeMeeting> MeetingsAlong(const EdgeOfSurface& first, const EdgeOfSurface& second,
                                       const EdgeComparison& how);

}  // namespace semblance
