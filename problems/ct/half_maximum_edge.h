// SPDX-License-Identifier: GPL-3.0-or-later
// Moves an iso-surface of a CT volume to where the edge really is.
#pragma once

#include "problems/volumes/ct_volume.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct HalfMaximumOptions {
  double reach_mm = 3;        // plateaus are looked for up to this far on either side
  double most_move_mm = 1.5;  // a vertex is moved no further
  double step_mm = 0.25;      // between samples of the profile
  int smoothings = 2;         // of the moves, over neighbouring vertices: they follow noise else
};

// A blurred edge lies midway between the plateaus on its two sides: the highest value within reach
// along the inward normal and the lowest along the outward one. Moves each vertex there along its
// normal and returns the mean move, outward positive. A vertex with no such crossing in reach
// counts as not to be moved.
double MoveToHalfMaximum(const CtVolume& volume, const HalfMaximumOptions& options,
                         const RunContext& context, TriMesh& mesh);

}  // namespace semblance
