// SPDX-License-Identifier: GPL-3.0-or-later
// The sizes of an H-spline's levels, and each level as a plain bicubic B-spline.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "surfaces/hspline/bspline.h"

namespace semblance::surfaces {

// The directions in which the surface is closed: none, or u (a tube).
enum class Closure { kOpen, kPeriodicU };
constexpr auto EnumNames(Closure) {
  return std::to_array<std::string_view>({"open", "periodic_u"});
}

// Brings u or v into [0,1]: wraps a closed direction, clamps an open one.
inline double IntoUnit(double x, bool closed) {
  return closed ? x - std::floor(x) : std::clamp(x, 0.0, 1.0);
}

// Brings an index into 0..count - 1: wraps it across the seam of a closed direction. Returns -1
// beyond the border of an open one.
constexpr int WrapIndex(int count, int k, bool closed) {
  return closed ? ((k % count) + count) % count : k >= 0 && k < count ? k : -1;
}

// The axes of an offset: the frame of the next coarser surface, so that detail turns with that
// surface, or the world's axes.
enum class OffsetReference { kFrame, kWorld };
constexpr auto EnumNames(OffsetReference) {
  return std::to_array<std::string_view>({"frame", "world"});
}

// Patches along one side of the finest level.
inline constexpr int kMaxPatches = 8192;

// The domain is [0,1] x [0,1]; level L has patches_u 2^L x patches_v 2^L patches.
struct HSplineShape {
  int patches_u = 8;  // on level 0; >= 1 (open) or >= 4 (closed)
  int patches_v = 8;  // on level 0; >= 1
  int max_level = 3;  // finest level with detail, 0..8; patches << max_level <= kMaxPatches
  Closure closure = Closure::kOpen;
  OffsetReference reference = OffsetReference::kFrame;

  bool ClosedU() const { return closure == Closure::kPeriodicU; }
  int PatchesU(int level) const { return patches_u << level; }
  int PatchesV(int level) const { return patches_v << level; }
  int Columns(int level) const { return PatchesU(level) + (ClosedU() ? 0 : 3); }
  int Rows(int level) const { return PatchesV(level) + 3; }
  // The column of a vertex whose index may lie across the seam.
  int Column(int level, int i) const {
    return ClosedU() ? (i + Columns(level)) % Columns(level) : i;
  }
  bool operator==(const HSplineShape&) const = default;
};

// The control vertex (i, j) of one level, with i along u and j along v.
struct VertexId {
  int level = -1;
  int i = -1;
  int j = -1;
  auto operator<=>(const VertexId&) const = default;
};

// The patch [i, i + 1] / PatchesU(level) x [j, j + 1] / PatchesV(level) of the domain. Its sixteen
// vertices are (i, j) to (i + 3, j + 3) of the level.
struct PatchId {
  int level = -1;
  int i = -1;
  int j = -1;
  auto operator<=>(const PatchId&) const = default;
};

// Orders of differentiation along u and v.
struct DerivativeOrder {
  int u = 0;  // 0, 1 or 2
  int v = 0;
};

// A point of the domain, as a patch and coordinates within the patch.
struct PatchPoint {
  PatchId patch;
  double s = kNaN;  // along u, 0..1
  double t = kNaN;  // along v, 0..1
};

// Throws InputError for sizes outside their bounds.
void CheckShape(const HSplineShape& shape);

// Throws InputError for a missing level or a (u,v) that is not finite.
void CheckParameter(const HSplineShape& shape, int level, const Vec2& uv);

// Finds the patch of `level` that holds uv, after IntoUnit of u and v. Does not check its
// arguments.
PatchPoint PatchPointAt(const HSplineShape& shape, int level, const Vec2& uv);

// The weights of the patch's sixteen vertices, in the order [a + 4 b] with a along u, for the
// surface's point or a derivative with respect to u and v in [0,1]: weight[a + 4 b] =
// PatchesU^order.u PatchesV^order.v B_a(s) B_b(t).
std::array<double, 16> PatchWeights(const HSplineShape& shape, const PatchPoint& at,
                                    DerivativeOrder order = {});

// The point of the plain B-spline of `level` (0..max_level) at uv, or a derivative with respect to
// u and v in [0,1], as a linear function of the level's net. uv as in PatchPointAt. Throws as
// CheckParameter does.
Stencil StencilAt(const HSplineShape& shape, int level, const Vec2& uv, DerivativeOrder order = {});

// The Greville point of a control vertex: the (u,v) of its greatest influence, ((i - 1) / PatchesU,
// (j - 1) / PatchesV), brought into the domain by IntoUnit.
Vec2 GrevillePoint(const HSplineShape& shape, const VertexId& vertex);

// The net of level + 1 that describes the same surface (a knot is inserted at the midpoint of each
// span).
ControlNet Refine(const HSplineShape& shape, const ControlNet& net, int level);

// The sixteen vertices of one of a patch's four children, from the sixteen vertices of the patch,
// both in the order [a + 4 b]. right and upper, 0 or 1, choose the child. Gives the same bytes as
// Refine.
std::array<Vec3, 16> RefinePatch(const std::array<Vec3, 16>& vertices, int right, int upper);

}  // namespace semblance::surfaces
