// SPDX-License-Identifier: GPL-3.0-or-later
// Edges of a surface that is to be fitted, joined to edges of surfaces that are there: options of
// `semblance fit`.
#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "problems/config/config_tree.h"
#include "surfaces/base/fields.h"
#include "surfaces/hspline_query/surface_edge.h"

namespace semblance {

enum class JoinContinuity { kPosition, kTangentPlane };
constexpr auto EnumNames(JoinContinuity) {
  return std::to_array<std::string_view>({"position", "tangent_plane"});
}

// What a join that holds leaves at most.
inline constexpr double kMostJoinGap = 1e-6;  // of the points' extent
inline constexpr double kMostJoinAngle_deg = 0.1;

struct SurfaceJoin {
  std::filesystem::path surface = {};                         // of an H-spline
  SurfaceEdge edge = SurfaceEdge::kU0;                        // of the new surface
  SurfaceEdge its_edge = SurfaceEdge::kU1;                    // of the given one
  bool reversed = false;                                      // they run against each other
  JoinContinuity continuity = JoinContinuity::kTangentPlane;  // G0 or G1
};
template <class Visitor>
void Fields(Visitor& visit, SurfaceJoin& o) {
  visit(FieldInfo{.name = "surface",
                  .doc = "an H-spline, such as another fit's "
                         "surface.hspline.json"},
        o.surface);
  visit(FieldInfo{.name = "edge",
                  .doc = "of the new surface, that follows the given one; u0: "
                         "where u = 0, from v = 0 to v = 1"},
        o.edge);
  visit(FieldInfo{.name = "its_edge", .doc = "of the given surface"}, o.its_edge);
  visit(FieldInfo{.name = "reversed",
                  .doc = "whether the given edge's parameter runs against the new one's"},
        o.reversed);
  visit(FieldInfo{.name = "continuity",
                  .doc = "tangent_plane: no gap and no crease (G1); position: no gap (G0)"},
        o.continuity);
}

// What is wrong with them whatever the surfaces are: a file that is not named, an edge that is
// joined twice, or one that the new surface, which may be closed, has not.
std::vector<OptionFault> JoinFaults(std::span<const SurfaceJoin> joins, Closure closure);

// A join whose surface has been read.
struct OpenedJoin {
  SurfaceJoin join;
  std::string sha256;  // of the file
  HSplineSurface surface;

  // Where the new edge is to be at t in [0,1] along it, in the given surface's (u,v).
  Vec2 ItsPlace(double t) const { return OnEdge(join.its_edge, join.reversed ? 1 - t : t); }
  // Of its edge's patches, in the order of the new edge's t.
  std::vector<EdgeSpan> ItsSpans() const;
  // Whether its curve is one that a new edge of so many patches can take, on a level that is fine
  // enough: the same patches but for a power of two.
  bool FitsInto(int patches) const;
  int ItsPatches() const { return PatchesAlong(surface.shape(), join.its_edge); }
};

// closure: of the new surface. Throws IoError as ReadHSpline, and InputError for a given edge that
// is no border, or is closed where the new one is open, or the other way round.
std::vector<OpenedJoin> OpenJoins(std::span<const SurfaceJoin> joins, Closure closure);

}  // namespace semblance
