// SPDX-License-Identifier: GPL-3.0-or-later
// Trims an implicit face so that it ends at the border of the skull, instead of going around its
// rim.
#pragma once

#include <span>

#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

// Keeps the triangles of a face that lie over the shell's triangles with finite depths (depth_mm:
// one per vertex). It drops the triangles that are nearest to the border of these shell triangles,
// and those behind the shell that are connected to them. Returns the remaining part with the
// largest area, with the face's orientation; it is a manifold if the face is one. Returns the whole
// face if the shell is closed and has depths everywhere. Throws InputError if nothing remains.
TriMesh TrimToSkull(const TriMesh& face, const TriMesh& shell, std::span<const double> depth_mm,
                    const RunContext& context);

}  // namespace semblance::surfaces
