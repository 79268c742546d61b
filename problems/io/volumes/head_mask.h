// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the voxels of the head in a volume, and those of the air around it.
#pragma once

#include <string>
#include <vector>

#include "problems/io/volumes/ct_volume.h"
#include "problems/io/volumes/voxel_mask.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

struct HeadMaskOptions {
  double skin_value = kNaN;       // voxels of at least this value are tissue, bone or furniture
  double thinnest_head_mm = 8;    // thinner objects apart from the head are dropped
  double widest_opening_mm = 12;  // air behind narrower openings is inside
};

struct HeadMask {
  VoxelMask head;                  // tissue and bone
  VoxelMask outside;               // air that reaches the sides of the volume, and all within it
  std::vector<std::string> notes;  // what was left out, a line each
};

VoxelGrid MakeVoxelGrid(const CtVolume& volume);

// 1 for voxels with a value of `least` or more.
VoxelMask AtLeast(const CtVolume& volume, double least);

VoxelMask Not(VoxelMask mask);
VoxelMask And(VoxelMask a, const VoxelMask& b);

// Distances are measured along the voxels' axes, so they are not exact if the axes are skew. Throws
// InputError if nothing is as thick as a head, or if no air reaches the sides.
HeadMask FindHeadMask(const CtVolume& volume, const HeadMaskOptions& options,
                      const RunContext& context);

}  // namespace semblance::problems
