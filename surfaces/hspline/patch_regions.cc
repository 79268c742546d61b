// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/patch_regions.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <set>

namespace semblance {
namespace {

// (level, j, i), which sorts patches row by row.
using PatchKey = std::array<int, 3>;

bool HasRow(const std::set<PatchKey>& patches, const PatchRegion& region, int j) {
  for (int i = region.i; i < region.i + region.columns; ++i) {
    if (!patches.contains({region.level, j, i})) {
      return false;
    }
  }
  return true;
}

}  // namespace

std::vector<PatchRegion> UniformRegions(const PatchTree& tree) {
  std::set<PatchKey> patches;
  for (const PatchId& leaf : tree.leaves()) {
    patches.insert({leaf.level, leaf.j, leaf.i});
  }
  std::vector<PatchRegion> regions;
  while (!patches.empty()) {
    const auto [level, j, i] = *patches.begin();
    PatchRegion region{level, i, j, 1, 1};
    while (patches.contains({level, j, i + region.columns})) {
      ++region.columns;
    }
    while (HasRow(patches, region, j + region.rows)) {
      ++region.rows;
    }
    for (int row = j; row < j + region.rows; ++row) {
      patches.erase(patches.find({level, row, i}),
                    std::next(patches.find({level, row, i + region.columns - 1})));
    }
    regions.push_back(region);
  }
  return regions;
}

std::vector<PatchRegion> FewRegions(const HSplineShape& shape, const PatchTree& tree) {
  int level = 0;
  for (const PatchId& leaf : tree.leaves()) {
    level = std::max(level, leaf.level);
  }
  const int columns = shape.PatchesU(level), rows = shape.PatchesV(level);
  const bool few = static_cast<std::size_t>(columns) * rows <= 4 * tree.leaves().size();
  return few ? std::vector{PatchRegion{level, 0, 0, columns, rows}} : UniformRegions(tree);
}

ControlNet RegionNet(const HSplineSurface& surface, const PatchRegion& region) {
  ControlNet net{region.columns + 3, region.rows + 3, {}};
  net.vertices.resize(static_cast<std::size_t>(net.columns) * net.rows);
  for (int j = 0; j < region.rows; ++j) {
    for (int i = 0; i < region.columns; ++i) {
      const std::array<Vec3, 16> vertices =
          surface.PatchVertices({region.level, region.i + i, region.j + j});
      for (int k = 0; k < 16; ++k) {
        net.At(i + k % 4, j + k / 4) = vertices[k];
      }
    }
  }
  return net;
}

}  // namespace semblance
