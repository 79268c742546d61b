// SPDX-License-Identifier: GPL-3.0-or-later
// The fewest polynomial patches that form an H-spline surface: small at detail, large elsewhere.
// Also the surface as few plain B-spline surfaces.
#pragma once

#include <cstdint>
#include <vector>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance::surfaces {

// The quadtree of a surface; later changes of the surface do not change it. A leaf is a patch that
// no offset of a finer level influences, so that the surface is one bicubic polynomial on it. The
// leaves cover the domain once.
class PatchTree {
 public:
  explicit PatchTree(const HSplineSurface& surface);

  const std::vector<PatchId>& leaves() const { return leaves_; }

  // Brings uv into the domain by IntoUnit. uv must be finite, which is not checked.
  Vec2 IntoDomain(const Vec2& uv) const;
  // The index of the leaf that contains a (u,v) of the domain.
  std::int32_t LeafAt(const Vec2& uv) const;

  std::size_t Bytes() const;  // memory in use

 private:
  void MakeGrid();

  HSplineShape shape_;
  // The nodes of level 0 row by row, then children in fours (v-major). An entry is the index of the
  // first child, or the complement ~k of leaf k.
  std::vector<std::int32_t> nodes_;
  // A shortcut into the tree: the entry of the node at each patch of grid_level_, or of the leaf
  // that contains the patch.
  int grid_level_ = 0;
  std::vector<std::int32_t> grid_;
  std::vector<PatchId> leaves_;
};

// The patches (i, j) to (i + columns - 1, j + rows - 1) of one level. No leaf among them is finer,
// so that the H-spline equals the level's plain B-spline on them.
struct PatchRegion {
  int level = -1;
  int i = -1, j = -1;
  int columns = 0, rows = 0;
  bool operator==(const PatchRegion&) const = default;
};

// Covers the domain once with rectangles of leaves of one level, each as wide as possible and then
// as high as possible. A face with detail everywhere is one region, and so is a surface without
// detail.
std::vector<PatchRegion> UniformRegions(const PatchTree& tree);

// Returns the whole domain on the finest leaf level as one region if this gives at most four times
// as many patches as leaves; otherwise UniformRegions.
std::vector<PatchRegion> FewRegions(const HSplineShape& shape, const PatchTree& tree);

// The (columns + 3) x (rows + 3) control vertices of the region.
ControlNet RegionNet(const HSplineSurface& surface, const PatchRegion& region);

}  // namespace semblance::surfaces
