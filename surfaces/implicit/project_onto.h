// SPDX-License-Identifier: GPL-3.0-or-later
// Laying a mesh that is near an implicit surface onto it.
#pragma once

#include "surfaces/base/run_context.h"
#include "surfaces/emitters/implicit_surface.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Moves each vertex along its normal onto the surface, by at most reach_mm: where it is not within
// that, and where a triangle would turn by a right angle or more, vertices stay.
void ProjectOnto(const ImplicitSurface& surface, double reach_mm, const RunContext& context,
                 TriMesh& mesh);

}  // namespace semblance
