// SPDX-License-Identifier: GPL-3.0-or-later
// The skin from an MR volume. Its grey values say nothing of bone, which is as dark as air.
#pragma once

#include <string>
#include <vector>

#include "problems/volumes/ct_volume.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct MrSkinOptions {
  double skin_value = 0;        // grey value of the skin's surface; 0: OtsuThreshold of the volume
  double thinnest_head_mm = 8;  // as CtImportOptions
  double widest_opening_mm = 12;  // as CtImportOptions
};

struct MrSkin {
  TriMesh skin;  // mm, LPS, outward; open where the volume cuts it
  double skin_value = kNaN;
  int dropped = -1;  // pieces that are not the largest
  std::vector<std::string> notes;
};

// The value that parts the volume's dark voxels from its bright ones with the least variance within
// both (Otsu 1979), of 256 classes up to the brightest but one in a thousand.
double OtsuThreshold(const CtVolume& volume);

// Throws InputError if the volume or the skin is smaller than a head, nothing is as thick as one,
// or no dark voxels reach the sides.
MrSkin ImportMrSkin(const CtVolume& volume, const MrSkinOptions& options,
                    const RunContext& context);

}  // namespace semblance
