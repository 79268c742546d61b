// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/patch_tree.h"

#include <algorithm>

#include "surfaces/hspline/patch_layout.h"

namespace semblance {

PatchTree::PatchTree(const HSplineSurface& surface) : shape_(surface.shape()) {
  std::vector<RowTable> split;  // by level: patches with finer detail inside
  const std::vector<LevelLayout> layout = LayoutOf(shape_, surface.Offsets());
  for (int level = 0; level < shape_.max_level; ++level) {
    split.emplace_back(Parents(layout[level + 1].needed), shape_.PatchesV(level));
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

// Memory of the shortcut: at most eight entries per leaf, so that it too grows with the detail.
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
  for (double s = x - i, t = y - j; node >= 0;) {  // doubling and taking 1 off are exact
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

}  // namespace semblance
