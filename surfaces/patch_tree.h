// SPDX-License-Identifier: GPL-3.0-or-later
// The fewest polynomial patches that make up an H-spline: fine where there is detail, coarse
// elsewhere.
#pragma once

#include <cstdint>
#include <vector>

#include "surfaces/hspline_surface.h"

namespace semblance {

// A patch of one level: u in [i, i + 1] / PatchesU(level), v likewise.
struct PatchId {
  int level = -1;
  int i = -1;
  int j = -1;
  auto operator<=>(const PatchId&) const = default;
};

// Where a parameter lies: the leaf, and the place in it.
struct LeafPlace {
  std::int32_t leaf = -1;
  double s = kNaN;  // along u, 0..1
  double t = kNaN;  // along v, 0..1
};

// The quadtree of a surface as it is now. A leaf is a patch that no offset of a finer level
// changes, so the surface is one bicubic polynomial there; the leaves cover the domain once.
class PatchTree {
 public:
  explicit PatchTree(const HSplineSurface& surface);

  const std::vector<PatchId>& leaves() const { return leaves_; }

  // uv is clamped or wrapped as in StencilAt, and must be finite (not checked here).
  LeafPlace Find(const Vec2& uv) const;

  std::size_t Bytes() const;  // of memory held

 private:
  HSplineShape shape_;
  std::vector<std::int32_t> nodes_;  // level 0 row by row, then children in fours (v-major): the
                                     // first child's index, or the complement of a leaf's
  std::vector<PatchId> leaves_;
};

// The sixteen vertices of the patch in its own level's net, [a + 4 b], a along u.
std::array<Vec3, 16> PatchVertices(const HSplineSurface& surface, const PatchId& patch);

}  // namespace semblance
