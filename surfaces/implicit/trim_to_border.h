// SPDX-License-Identifier: GPL-3.0-or-later
// An implicit face that ends where the skull does, instead of going around its rim.
#pragma once

#include <span>

#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Of a face, the triangles that lie over the shell where it has a depth (finite; one a vertex):
// what has the border of its triangles with depths nearest to it goes, and what is behind them and
// joined to that. Of the pieces that leaves, the one with the most area; a manifold if the face is,
// with the same orientation. All of the face where the shell is closed and has a depth everywhere.
// Throws InputError if nothing is left.
TriMesh TrimToSkull(const TriMesh& face, const TriMesh& shell, std::span<const double> depth_mm,
                    const RunContext& context);

}  // namespace semblance
