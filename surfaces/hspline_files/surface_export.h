// SPDX-License-Identifier: GPL-3.0-or-later
// H-splines for other programs.
#pragma once

#include <string>

#include "surfaces/hspline_query/tessellate.h"

namespace semblance {

// VTK's XML for ParaView and meshio: the exact surface, one bicubic VTK_LAGRANGE_QUADRILATERAL for
// each of its polynomial patches (patch_tree.h), through 4 x 4 points of it, in mm; cell data
// `level`. Numbers round-trip to the bit.
std::string SurfaceToVtu(const HSplineSurface& surface);

// Binary glTF 2.0 (glb.h): one node `face` with normals, in metres, +y up, the face towards +z,
// subject left +x. Single precision. A normal of zero becomes that of the triangles around it.
// Throws InputError for a tessellation without triangles or whose points and normals differ in
// number.
std::string TessellationToGlb(const Tessellation& tessellation);

}  // namespace semblance
