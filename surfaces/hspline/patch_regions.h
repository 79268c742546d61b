// SPDX-License-Identifier: GPL-3.0-or-later
// An H-spline as few plain B-spline surfaces.
#pragma once

#include <vector>

#include "surfaces/hspline/patch_tree.h"

namespace semblance {

// Patches (i, j) to (i + columns - 1, j + rows - 1) of one level; on them the H-spline is the
// plain B-spline of that level, as no leaf there is finer.
struct PatchRegion {
  int level = -1;
  int i = -1, j = -1;
  int columns = 0, rows = 0;
  bool operator==(const PatchRegion&) const = default;
};

// Rectangles of leaves of one level, each as wide as it can be and then as high; they cover the
// domain once. A face with detail everywhere is one region, a surface without detail too.
std::vector<PatchRegion> UniformRegions(const PatchTree& tree);

// The whole domain on the finest level of the leaves, where this makes at most four times as many
// patches as there are leaves; else the uniform regions.
std::vector<PatchRegion> FewRegions(const HSplineShape& shape, const PatchTree& tree);

// The region's vertices, (columns + 3) x (rows + 3).
ControlNet RegionNet(const HSplineSurface& surface, const PatchRegion& region);

}  // namespace semblance
