// SPDX-License-Identifier: GPL-3.0-or-later
// An implicit face that ends where the skull does, instead of going around its rim.
#pragma once

#include <span>

#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// The triangles of a face that lie over the shell's triangles with depths (finite; one per vertex).
// Dropped is what is nearest to the border of these triangles, and what lies behind them and is
// joined to that. Of the parts that are left the one with the most area is returned: a manifold if
// the face is, with the same orientation; the whole face where the shell is closed and has a depth
// everywhere. Throws InputError if nothing is left.
TriMesh TrimToSkull(const TriMesh& face, const TriMesh& shell, std::span<const double> depth_mm,
                    const RunContext& context);

}  // namespace semblance
