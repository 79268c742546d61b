// SPDX-License-Identifier: GPL-3.0-or-later
// From a skull with its depths to the triangles that emit. For implicit_surface.cc alone.
#pragma once

#include <span>
#include <vector>

#include "surfaces/emitters/emitter_kernel.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// One a triangle that has depths and an area; several where the depth is linear over it and changes
// much. Throws InputError as ImplicitSurface does.
std::vector<EmitterTriangle> MakeEmitters(const TriMesh& skull, std::span<const double> depth_mm,
                                          EmitterDepth over_triangle, const Kernel& kernel);

}  // namespace semblance
