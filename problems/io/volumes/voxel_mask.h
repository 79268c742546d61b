// SPDX-License-Identifier: GPL-3.0-or-later
// Sets of voxels: connected components, flooding, and dilation by a distance.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "problems/io/volumes/large_pages.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

// The size and spacing of a regular grid; its first axis runs fastest.
struct VoxelGrid {
  std::array<int, 3> counts = {0, 0, 0};
  Vec3 spacing_mm = Vec3::Constant(kNaN);

  std::int64_t Index(int i, int j, int k) const {
    return i + std::int64_t{counts[0]} * (j + std::int64_t{counts[1]} * k);
  }
  std::int64_t Count() const { return std::int64_t{counts[0]} * counts[1] * counts[2]; }
};

// One entry per voxel: 1 in the set, 0 outside.
using VoxelMask = std::vector<std::uint8_t, LargePages<std::uint8_t>>;

// Voxels of a mask that follow each other along the first axis.
struct VoxelRun {
  std::int64_t first = -1;  // index of the first voxel
  std::int32_t length = 0;
  std::int32_t component = -1;
};

// The connected components of a mask, numbered 0, 1, ... in order of their first voxel. Voxels are
// connected if they share a face.
struct VoxelComponents {
  std::vector<VoxelRun> runs;       // all voxels of the mask, in order
  std::vector<std::int64_t> sizes;  // number of voxels per component

  // Number of the largest component, the first one if several are equal; -1 if there is none.
  int Largest() const;
};
VoxelComponents LabelComponents(const VoxelMask& mask, const VoxelGrid& grid);

// The voxels of the components for which keep[component] is true.
VoxelMask MakeMask(const VoxelComponents& components, const std::vector<bool>& keep,
                   const VoxelGrid& grid);

// The components of `allowed` that contain a voxel of `starts`.
VoxelMask Flood(const VoxelMask& allowed, const VoxelMask& starts, const VoxelGrid& grid);

// The voxels whose centre is within distance_mm (>= 0) of the centre of a voxel in the mask. Exact
// for axes at right angles.
VoxelMask Dilate(const VoxelMask& mask, const VoxelGrid& grid, double distance_mm, int threads);

}  // namespace semblance::problems
