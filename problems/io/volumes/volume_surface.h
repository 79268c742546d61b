// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces of constant value in a volume, and their refinement to the edges of the image.
#pragma once

#include <functional>

#include "problems/io/volumes/ct_volume.h"
#include "problems/io/volumes/head_mask.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// The surface on which value_of(index of the voxel) equals `threshold`: LPS, mm, outward from
// higher values, open where the volume ends. Exact for axes of any direction, skew ones too,
// because marching cubes uses no angles.
TriMesh SurfaceAt(const CtVolume& volume, double threshold,
                  const std::function<double(std::size_t)>& value_of, const RunContext& context);

// The largest surface between the head and the air outside, at `skin_value`. `inside` (>
// skin_value) is the value that replaces air within the head. `dropped` receives the number of
// smaller pieces.
TriMesh SkinSurface(const CtVolume& volume, const HeadMask& mask, double skin_value, double inside,
                    const RunContext& context, int& dropped);

struct HalfMaximumOptions {
  double reach_mm = 3;       // plateaus are searched up to this far on either side
  double max_move_mm = 1.5;  // a vertex moves at most this far
  double step_mm = 0.25;     // between samples of the profile
  int smoothings = 2;        // of the moves over neighbouring vertices; without them moves follow
                             // the noise
};

// Moves each vertex along its normal to the edge of the image, and returns the mean move, outward
// positive. A blurred edge lies midway between the plateaus on its two sides: the highest value
// within reach along the inward normal and the lowest along the outward one. A vertex without such
// a crossing within reach counts as one that does not move.
double MoveToHalfMaximum(const CtVolume& volume, const HalfMaximumOptions& options,
                         const RunContext& context, TriMesh& mesh);

}  // namespace semblance::problems
