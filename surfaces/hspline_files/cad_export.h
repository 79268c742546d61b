// SPDX-License-Identifier: GPL-3.0-or-later
// H-splines for CAD programs, exactly. Optional: built with OpenCASCADE where it is installed
// (SEMBLANCE_WITH_CAD).
#pragma once

#include <string>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

bool HasCad();  // whether this build can write STEP and IGES

// One face for the whole surface, or, where detail is rare and fine, one per uniform region
// (FewRegions in patch_regions.h). Each is a bicubic B-spline surface with clamped knots whose
// parameters are the H-spline's own (u,v), in mm. The faces meet exactly but are not sewn: a
// finer one's edge is part of a coarser one's. The bytes do not depend on when it was written.
// Throws InputError in a build without the component.
std::string SurfaceToStep(const HSplineSurface& surface);  // ISO 10303-214
std::string SurfaceToIges(const HSplineSurface& surface);  // IGES 5.3, entities 128 and 144

}  // namespace semblance
