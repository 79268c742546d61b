// SPDX-License-Identifier: GPL-3.0-or-later
// Writes an H-spline as a file for other programs.
#pragma once

#include <optional>
#include <string>

#include "surfaces/hspline_query/tessellate.h"

namespace semblance::surfaces {

// Encodes a surface in the format of a file ending (lower or upper case).
//   Exact, in mm: .vtu (bicubic patches); .step .stp and .iges .igs (B-spline surfaces).
//   Triangles within a chord error: .glb (metres); .vtp .ply .obj .off .stl (mm). A .vtp and a .ply
//   also have normals and the mean and Gaussian curvature per vertex.
// chord_mm: for triangles only; by default 0.1, or 1/5000 of the extent if that is more. Throws
// InputError for another ending, or a chord error with an exact format.
std::string EncodeFace(const HSplineSurface& surface, const std::string& extension,
                       std::optional<double> chord_mm = {}, int threads = 1);

// Writes VTK's XML (.vtu) for ParaView and meshio: the exact surface as one bicubic
// VTK_LAGRANGE_QUADRILATERAL per polynomial patch (patch_tree.h), through 4 x 4 of its points, in
// mm, with the cell data `level`. Numbers round-trip to the bit.
std::string SurfaceToVtu(const HSplineSurface& surface);

// Writes binary glTF 2.0 (glb.h): one node `face` with normals, in metres, +y up, the face towards
// +z, the subject's left at +x, in single precision. A zero normal is replaced by the mean normal
// of the triangles around the vertex. Throws InputError if there are no triangles, or not one
// normal per point.
std::string TessellationToGlb(const Tessellation& tessellation);

// Returns true if this build can write STEP and IGES, which needs OpenCASCADE
// (SEMBLANCE_WITH_CAD).
bool HasCad();

// Writes the exact surface for CAD programs, in mm. It is one B-spline face or, if fine detail is
// rare, one face per uniform region (FewRegions in patch_tree.h). Each face is bicubic with clamped
// knots, and its parameters are the H-spline's own (u,v). The faces meet exactly but are not sewn,
// because the edge of a finer face is part of a coarser face's edge. The bytes do not depend on the
// time. Throws InputError in a build without OpenCASCADE.
std::string SurfaceToStep(const HSplineSurface& surface);  // ISO 10303-214
std::string SurfaceToIges(const HSplineSurface& surface);  // IGES 5.3, entities 128 and 144

}  // namespace semblance::surfaces
