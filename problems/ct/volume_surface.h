// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces of constant value in a volume.
#pragma once

#include <functional>

#include "problems/ct/head_mask.h"
#include "problems/volumes/ct_volume.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Where value_of(index of the voxel) crosses `threshold`, in LPS mm, outward from higher values;
// open where the volume ends. Exact for axes of any direction, skew ones too: marching cubes knows
// no angles.
TriMesh SurfaceAt(const CtVolume& volume, double threshold,
                  const std::function<double(std::size_t)>& value_of, const RunContext& context);

// The largest surface between the head and the air outside, at `skin_value`. `inside` is what air
// within the head counts as, > skin_value. dropped: pieces that are not the largest.
TriMesh SkinSurface(const CtVolume& volume, const HeadMask& mask, double skin_value, double inside,
                    const RunContext& context, int& dropped);

}  // namespace semblance
