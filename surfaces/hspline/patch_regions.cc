// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/patch_regions.h"

#include <algorithm>
#include <set>

namespace semblance {
namespace {

// (level, j, i): row by row.
using Cell = std::array<int, 3>;

bool HasRow(const std::set<Cell>& cells, const PatchRegion& region, int j) {
  for (int i = region.i; i < region.i + region.columns; ++i) {
    if (!cells.contains({region.level, j, i})) {
      return false;
    }
  }
  return true;
}

}  // namespace

std::vector<PatchRegion> UniformRegions(const PatchTree& tree) {
  std::set<Cell> cells;
  for (const PatchId& leaf : tree.leaves()) {
    cells.insert({leaf.level, leaf.j, leaf.i});
  }
  std::vector<PatchRegion> regions;
  while (!cells.empty()) {
    const auto [level, j, i] = *cells.begin();
    PatchRegion region{level, i, j, 1, 1};
    while (cells.contains({level, j, i + region.columns})) {
      ++region.columns;
    }
    while (HasRow(cells, region, j + region.rows)) {
      ++region.rows;
    }
    for (int row = j; row < j + region.rows; ++row) {
      cells.erase(cells.find({level, row, i}),
                  std::next(cells.find({level, row, i + region.columns - 1})));
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
