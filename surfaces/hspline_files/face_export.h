// SPDX-License-Identifier: GPL-3.0-or-later
// An H-spline face as the bytes of a file of another program.
#pragma once

#include <optional>
#include <string>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// By the file's ending (lower or upper case): exactly, .vtu (bicubic patches), .step .stp and .iges
// .igs (B-spline surfaces), all in mm; as triangles that keep a chord error, .glb (metres), .vtp
// .ply .obj .off .stl (mm). A .vtp and a .ply also have normals and the mean and Gaussian curvature
// per vertex. chord_mm: of triangles, 0.1 if not given. Throws InputError for another ending, or a
// chord error for an exact format.
std::string EncodeFace(const HSplineSurface& surface, const std::string& extension,
                       std::optional<double> chord_mm = {}, int threads = 1);

}  // namespace semblance
