// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/ct/voxel_mask.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "surfaces/base/parallel.h"

namespace semblance {
namespace {

// Calls visit(index) for each voxel that shares a face with the given one.
template <class Visit>
void ForNeighbours(const VoxelGrid& grid, std::int64_t index, const Visit& visit) {
  std::int64_t rest = index, stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t at = rest % grid.counts[axis];
    if (at > 0) {
      visit(index - stride);
    }
    if (at + 1 < grid.counts[axis]) {
      visit(index + stride);
    }
    rest /= grid.counts[axis];
    stride *= grid.counts[axis];
  }
}

// Lowers each squared distance to that over a neighbour on the same line along `axis`, if that is
// within the reach.
void DistancePass(int axis, const VoxelGrid& grid, double reach_mm, int threads,
                  std::vector<float>& squared) {
  std::int64_t stride = 1;
  for (int a = 0; a < axis; ++a) {
    stride *= grid.counts[a];
  }
  const int count = grid.counts[axis];
  const double spacing = grid.spacing_mm[axis];
  const int window = std::min(count - 1, static_cast<int>(reach_mm / spacing));
  const std::size_t lines = static_cast<std::size_t>(grid.Count() / count);
  ParallelFor(lines, threads, 512, [&](std::size_t line) {
    const auto l = static_cast<std::int64_t>(line);
    const std::int64_t first = l % stride + l / stride * stride * count;
    std::vector<float> before(count);
    for (int n = 0; n < count; ++n) {
      before[n] = squared[first + n * stride];
    }
    for (int n = 0; n < count; ++n) {
      float best = before[n];
      for (int m = std::max(0, n - window); m <= std::min(count - 1, n + window); ++m) {
        best =
            std::min(best, before[m] + static_cast<float>(spacing * spacing * (m - n) * (m - n)));
      }
      squared[first + n * stride] = best;
    }
  });
}

}  // namespace

VoxelComponents LabelComponents(const VoxelMask& mask, const VoxelGrid& grid) {
  VoxelComponents components;
  components.of_voxel.assign(mask.size(), -1);
  std::vector<std::int64_t> open;
  for (std::int64_t start = 0; start < grid.Count(); ++start) {
    if (!mask[start] || components.of_voxel[start] >= 0) {
      continue;
    }
    const auto component = static_cast<std::int32_t>(components.sizes.size());
    components.sizes.push_back(1);
    components.of_voxel[start] = component;
    open.assign(1, start);
    while (!open.empty()) {
      const std::int64_t voxel = open.back();
      open.pop_back();
      ForNeighbours(grid, voxel, [&](std::int64_t next) {
        if (mask[next] && components.of_voxel[next] < 0) {
          components.of_voxel[next] = component;
          ++components.sizes[component];
          open.push_back(next);
        }
      });
    }
  }
  return components;
}

VoxelMask Flood(const VoxelMask& allowed, const VoxelMask& starts, const VoxelGrid& grid) {
  VoxelMask reached(allowed.size(), 0);
  std::vector<std::int64_t> open;
  const auto visit = [&](std::int64_t voxel) {
    if (allowed[voxel] && !reached[voxel]) {
      reached[voxel] = 1;
      open.push_back(voxel);
    }
  };
  for (std::int64_t start = 0; start < grid.Count(); ++start) {
    if (starts[start]) {
      visit(start);
    }
    while (!open.empty()) {
      const std::int64_t voxel = open.back();
      open.pop_back();
      ForNeighbours(grid, voxel, visit);
    }
  }
  return reached;
}

VoxelMask Dilate(const VoxelMask& mask, const VoxelGrid& grid, double distance_mm, int threads) {
  std::vector<float> squared(mask.size());
  std::transform(mask.begin(), mask.end(), squared.begin(), [](std::uint8_t in) {
    return in ? 0.0F : std::numeric_limits<float>::infinity();
  });
  for (int axis = 0; axis < 3; ++axis) {
    DistancePass(axis, grid, distance_mm, threads, squared);
  }
  const auto limit = static_cast<float>(distance_mm * distance_mm * (1 + 1e-6));
  VoxelMask grown(mask.size());
  std::transform(squared.begin(), squared.end(), grown.begin(),
                 [&](float d) { return static_cast<std::uint8_t>(d <= limit); });
  return grown;
}

}  // namespace semblance
