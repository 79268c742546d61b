// SPDX-License-Identifier: GPL-3.0-or-later
// Voxels in the order of a file, whichever way its axes run, and how they become a CtVolume.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "problems/volumes/ct_volume.h"

namespace semblance {

struct VoxelArray {
  std::array<int, 3> counts = {0, 0, 0};
  Vec3 origin = Vec3::Constant(kNaN);  // centre of the first voxel, LPS, mm
  Mat3 steps = Mat3::Constant(kNaN);   // columns: from a voxel to the next along each axis, mm
  std::vector<std::int16_t> values;    // the first axis runs fastest
  std::int64_t clipped = 0;            // values beyond int16, set to its ends
  std::int64_t not_finite = 0;         // values that are no numbers, set to the lowest
  std::vector<std::string> notes;  // what the file leaves open, and how it is taken, a line each
};

// The same voxels at the same places, with the axes of CtVolume: exchanged and turned about where
// the file has them otherwise. Throws InputError, naming `where`, as CheckVolume.
CtVolume ToCtVolume(VoxelArray array, const std::string& where);

}  // namespace semblance
