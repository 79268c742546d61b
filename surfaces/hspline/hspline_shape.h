// SPDX-License-Identifier: GPL-3.0-or-later
// The levels of an H-spline: their sizes, and each of them as a plain bicubic B-spline.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "surfaces/hspline/control_net.h"

namespace semblance {

// Whether the surface goes round: not at all, or along u, as a tube does.
enum class Closure { kOpen, kPeriodicU };
constexpr auto EnumNames(Closure) {
  return std::to_array<std::string_view>({"open", "periodic_u"});
}

// u or v as a number of [0,1]: wrapped along a closed direction, clamped along an open one.
inline double IntoUnit(double x, bool closed) {
  return closed ? x - std::floor(x) : std::clamp(x, 0.0, 1.0);
}

// The place of k among `count` vertices or patches, which may lie across a seam; -1 beyond a
// border.
constexpr int PlaceAmong(int count, int k, bool closed) {
  return closed ? ((k % count) + count) % count : k >= 0 && k < count ? k : -1;
}

// The axes of an offset: the frame of the next coarser surface, so that detail turns with it, or
// the world's.
enum class OffsetReference { kFrame, kWorld };
constexpr auto EnumNames(OffsetReference) {
  return std::to_array<std::string_view>({"frame", "world"});
}

// Along one side of the finest level.
inline constexpr int kMostPatches = 8192;

// The domain is [0,1] x [0,1]; level L has patches_u 2^L x patches_v 2^L patches.
struct HSplineShape {
  int patches_u = 8;  // of level 0; >= 1 (open), >= 4 (closed); at most kMostPatches
  int patches_v = 8;  // of level 0; 1..kMostPatches
  int max_level = 3;  // finest level that may hold detail; 0..8
  Closure closure = Closure::kOpen;
  OffsetReference reference = OffsetReference::kFrame;

  bool ClosedU() const { return closure == Closure::kPeriodicU; }
  int PatchesU(int level) const { return patches_u << level; }
  int PatchesV(int level) const { return patches_v << level; }
  int Columns(int level) const { return PatchesU(level) + (ClosedU() ? 0 : 3); }
  int Rows(int level) const { return PatchesV(level) + 3; }
  // The column of a vertex that may lie across the seam.
  int Column(int level, int i) const {
    return ClosedU() ? (i + Columns(level)) % Columns(level) : i;
  }
  bool operator==(const HSplineShape&) const = default;
};

// A control vertex of one level; (i, j) along u and v.
struct VertexId {
  int level = -1;
  int i = -1;
  int j = -1;
  auto operator<=>(const VertexId&) const = default;
};

// A patch of one level: u in [i, i + 1] / PatchesU(level), v likewise. Its vertices are (i, j) to
// (i + 3, j + 3) of the level.
struct PatchId {
  int level = -1;
  int i = -1;
  int j = -1;
  auto operator<=>(const PatchId&) const = default;
};

// Orders of derivation along u and v.
struct DerivativeOrder {
  int u = 0;  // 0, 1 or 2
  int v = 0;
};

// A point of the domain, as a patch and coordinates in it.
struct PatchPoint {
  PatchId patch;
  double s = kNaN;  // along u, 0..1
  double t = kNaN;  // along v, 0..1
};

// Throws InputError for sizes outside the bounds above.
void CheckShape(const HSplineShape& shape);

// Throws InputError for a level that is not there or a (u,v) that is not finite.
void CheckParameter(const HSplineShape& shape, int level, const Vec2& uv);

// The patch of `level` at uv: v is clamped into [0,1], and u clamped (open) or wrapped (closed).
// The arguments are not checked.
PatchPoint PatchPointAt(const HSplineShape& shape, int level, const Vec2& uv);

// The weights of the patch's sixteen vertices, [a + 4 b] with a along u, for the surface's point,
// or for its derivative with respect to u, v in [0,1].
std::array<double, 16> PatchWeights(const HSplineShape& shape, const PatchPoint& at,
                                    DerivativeOrder order = {});

// The sixteen vertices of `level` that make the point of the plain B-spline at uv, or its
// derivative with respect to u, v in [0,1]. uv: as in PatchPointAt. level: 0..shape.max_level.
// Throws as CheckParameter.
Stencil StencilAt(const HSplineShape& shape, int level, const Vec2& uv, DerivativeOrder order = {});

// The (u,v) where a control vertex has the greatest influence: v is clamped into [0,1], and u
// clamped (open) or wrapped (closed).
Vec2 ParameterOf(const HSplineShape& shape, const VertexId& vertex);

// The net of the same surface one level finer (knot insertion at every midpoint).
ControlNet Refine(const HSplineShape& shape, const ControlNet& net, int level);

// The sixteen vertices of the child of a patch, from those of the patch, both [a + 4 b]. right,
// upper: 0 or 1, which of the four children. The same bytes as Refine.
std::array<Vec3, 16> RefinePatch(const std::array<Vec3, 16>& vertices, int right, int upper);

}  // namespace semblance
