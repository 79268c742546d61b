// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/patch_tree.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <set>

namespace semblance::surfaces {
namespace {

// (level, j, i), which orders patches row by row.
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

PatchTree::PatchTree(const HSplineSurface& surface) : shape_(surface.shape()) {
  std::vector<RowTable> split;  // by level, the patches with finer detail
  const std::vector<LevelLayout> layout = MakeLayouts(shape_, surface.Offsets());
  for (int level = 0; level < shape_.max_level; ++level) {
    split.emplace_back(ParentPatches(layout[level + 1].needed), shape_.PatchesV(level));
  }
  split.emplace_back();
  std::vector<PatchId> patches;  // one per node
  for (int j = 0; j < shape_.patches_v; ++j) {
    for (int i = 0; i < shape_.patches_u; ++i) {
      patches.push_back({0, i, j});
    }
  }
  for (std::size_t n = 0; n < patches.size(); ++n) {
    const PatchId patch = patches[n];
    if (split[patch.level].Find(patch.i, patch.j) < 0) {
      nodes_.push_back(~static_cast<std::int32_t>(leaves_.size()));
      leaves_.push_back(patch);
      continue;
    }
    nodes_.push_back(static_cast<std::int32_t>(patches.size()));
    for (int child = 0; child < 4; ++child) {
      patches.push_back({patch.level + 1, 2 * patch.i + child % 2, 2 * patch.j + child / 2});
    }
  }
  MakeGrid();
}

// Chooses the finest shortcut with at most eight entries per leaf, so that its memory also grows
// with the detail. More entries save steps down the tree.
void PatchTree::MakeGrid() {
  const std::size_t most = 8 * leaves_.size();
  const auto count = [&](int level) {
    return static_cast<std::size_t>(shape_.PatchesU(level)) * shape_.PatchesV(level);
  };
  while (grid_level_ < shape_.max_level && count(grid_level_ + 1) <= most) {
    ++grid_level_;
  }
  grid_.reserve(count(grid_level_));
  for (int j = 0; j < shape_.PatchesV(grid_level_); ++j) {
    for (int i = 0; i < shape_.PatchesU(grid_level_); ++i) {
      std::int32_t node = nodes_[(i >> grid_level_) + shape_.patches_u * (j >> grid_level_)];
      for (int shift = grid_level_ - 1; shift >= 0 && node >= 0; --shift) {
        node = nodes_[node + (i >> shift & 1) + 2 * (j >> shift & 1)];
      }
      grid_.push_back(node);
    }
  }
}

Vec2 PatchTree::IntoDomain(const Vec2& uv) const {
  return {IntoUnit(uv.x(), shape_.ClosedU()), std::clamp(uv.y(), 0.0, 1.0)};
}

std::int32_t PatchTree::LeafAt(const Vec2& uv) const {
  const int columns = shape_.PatchesU(grid_level_), rows = shape_.PatchesV(grid_level_);
  const double x = uv.x() * columns, y = uv.y() * rows;
  const int i = std::min(static_cast<int>(x), columns - 1),
            j = std::min(static_cast<int>(y), rows - 1);
  std::int32_t node = grid_[i + static_cast<std::size_t>(columns) * j];
  for (double s = x - i, t = y - j; node >= 0;) {  // doubling and subtracting 1 are exact
    const int right = s >= 0.5, upper = t >= 0.5;
    s = 2 * s - right;
    t = 2 * t - upper;
    node = nodes_[node + right + 2 * upper];
  }
  return ~node;
}

std::size_t PatchTree::Bytes() const {
  return nodes_.capacity() * sizeof(nodes_[0]) + leaves_.capacity() * sizeof(leaves_[0]) +
         grid_.capacity() * sizeof(grid_[0]);
}

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

}  // namespace semblance::surfaces
