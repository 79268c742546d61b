// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/patch_tree.h"

#include <algorithm>
#include <cmath>

namespace semblance {
namespace {

// The patches that must be split: some offset of a finer level reaches into them. Sorted.
std::vector<PatchId> SplitPatches(const HSplineSurface& surface) {
  const HSplineShape& shape = surface.shape();
  const bool periodic = shape.closure == Closure::kPeriodicU;
  std::vector<PatchId> split;
  for (const auto& [vertex, offset] : surface.Offsets()) {
    const int columns = shape.PatchesU(vertex.level), rows = shape.PatchesV(vertex.level);
    for (int j = std::max(vertex.j - 3, 0); j <= std::min(vertex.j, rows - 1); ++j) {
      for (int i = vertex.i - 3; i <= vertex.i; ++i) {
        if (!periodic && (i < 0 || i >= columns)) {
          continue;
        }
        const int wrapped = (i + columns) % columns;
        for (int level = vertex.level - 1, shift = 1; level >= 0; --level, ++shift) {
          split.push_back({level, wrapped >> shift, j >> shift});
        }
      }
    }
  }
  std::sort(split.begin(), split.end());
  split.erase(std::unique(split.begin(), split.end()), split.end());
  return split;
}

// The patch along one direction of level 0, and the place in it.
std::pair<int, double> Locate(double x, int patches, bool periodic) {
  x = periodic ? x - std::floor(x) : std::clamp(x, 0.0, 1.0);
  const int patch = std::min(static_cast<int>(x * patches), patches - 1);
  return {patch, x * patches - patch};
}

}  // namespace

PatchTree::PatchTree(const HSplineSurface& surface) : shape_(surface.shape()) {
  const std::vector<PatchId> split = SplitPatches(surface);
  std::vector<PatchId> patches;  // one a node
  for (int j = 0; j < shape_.patches_v; ++j) {
    for (int i = 0; i < shape_.patches_u; ++i) {
      patches.push_back({0, i, j});
    }
  }
  for (std::size_t n = 0; n < patches.size(); ++n) {
    const PatchId patch = patches[n];
    if (!std::binary_search(split.begin(), split.end(), patch)) {
      nodes_.push_back(~static_cast<std::int32_t>(leaves_.size()));
      leaves_.push_back(patch);
      continue;
    }
    nodes_.push_back(static_cast<std::int32_t>(patches.size()));
    for (int child = 0; child < 4; ++child) {
      patches.push_back({patch.level + 1, 2 * patch.i + child % 2, 2 * patch.j + child / 2});
    }
  }
}

LeafPlace PatchTree::Find(const Vec2& uv) const {
  auto [i, s] = Locate(uv.x(), shape_.patches_u, shape_.closure == Closure::kPeriodicU);
  auto [j, t] = Locate(uv.y(), shape_.patches_v, false);
  std::int32_t node = nodes_[i + shape_.patches_u * j];
  while (node >= 0) {  // doubling and taking 1 off are exact
    const int right = s >= 0.5, upper = t >= 0.5;
    s = 2 * s - right;
    t = 2 * t - upper;
    node = nodes_[node + right + 2 * upper];
  }
  return {~node, s, t};
}

std::size_t PatchTree::Bytes() const {
  return nodes_.capacity() * sizeof(nodes_[0]) + leaves_.capacity() * sizeof(leaves_[0]);
}

std::array<Vec3, 16> PatchVertices(const HSplineSurface& surface, const PatchId& patch) {
  const ControlNet& net = surface.Net(patch.level);
  std::array<Vec3, 16> vertices;
  for (int b = 0; b < 4; ++b) {
    for (int a = 0; a < 4; ++a) {
      vertices[a + 4 * b] = net.At((patch.i + a) % net.columns, patch.j + b);
    }
  }
  return vertices;
}

}  // namespace semblance
