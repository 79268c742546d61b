// SPDX-License-Identifier: GPL-3.0-or-later
// The fewest polynomial patches that make up an H-spline: small where there is detail, large
// elsewhere.
#pragma once

#include <cstdint>
#include <vector>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// The quadtree of a surface as it is now. A leaf is a patch that no offset of a finer level
// changes, so the surface is one bicubic polynomial there; the leaves cover the domain once.
class PatchTree {
 public:
  explicit PatchTree(const HSplineSurface& surface);

  const std::vector<PatchId>& leaves() const { return leaves_; }

  // uv clamped or wrapped as in PatchPointAt. It must be finite (not checked here).
  Vec2 IntoDomain(const Vec2& uv) const;
  // The leaf, as an index, that holds a (u,v) of the domain.
  std::int32_t LeafAt(const Vec2& uv) const;

  std::size_t Bytes() const;  // of memory held

 private:
  void MakeGrid();

  HSplineShape shape_;
  std::vector<std::int32_t> nodes_;  // level 0 row by row, then children in fours (v-major): the
                                     // first child's index, or the complement of a leaf's
  int grid_level_ = 0;               // of a shortcut into the tree: the node of each patch of this
  std::vector<std::int32_t> grid_;   // level, or the leaf that holds it
  std::vector<PatchId> leaves_;
};

}  // namespace semblance
