// SPDX-License-Identifier: GPL-3.0-or-later
// Which voxels of a volume are the head's, and which are the air about it.
#pragma once

#include <string>
#include <vector>

#include "problems/ct/voxel_mask.h"
#include "problems/volumes/ct_volume.h"
#include "surfaces/base/run_context.h"

namespace semblance {

struct HeadMaskOptions {
  double skin_value = kNaN;       // voxels with this and more are tissue, bone or furniture
  double thinnest_head_mm = 8;    // thinner things apart from the head are dropped
  double widest_opening_mm = 12;  // air behind narrower openings is inside
};

struct HeadMask {
  VoxelMask head;     // its tissue and bone
  VoxelMask outside;  // air that reaches the sides of the volume, and all that lies in it
  std::vector<std::string> notes;  // what was left out, a line each
};

VoxelGrid GridOf(const CtVolume& volume);

// 1 where the value is `least` or more.
VoxelMask AtLeast(const CtVolume& volume, double least);

VoxelMask Not(VoxelMask mask);
VoxelMask And(VoxelMask a, const VoxelMask& b);

// Distances are along the voxels' axes: not exact where these are skew. Throws InputError if
// nothing is as thick as a head, or no air reaches the sides.
HeadMask FindHeadMask(const CtVolume& volume, const HeadMaskOptions& options,
                      const RunContext& context);

}  // namespace semblance
