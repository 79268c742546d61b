// SPDX-License-Identifier: GPL-3.0-or-later
// Landmarks in 3D Slicer's older fiducial lists (.fcsv).
#pragma once

#include <string>
#include <string_view>

#include "problems/subject/landmarks.h"

namespace semblance {

// The points in order: labels as `site`, descriptions as `note`, coordinates as they stand; `axes`
// is LPS or RAS as the file's second line says (numbers in old files: 0 is RAS, 1 is LPS). file:
// its name, for messages. Throws IoError with the line for anything else: no axes, no columns x, y,
// z and label, a coordinate that is not a finite number.
LandmarkFile ParseFcsv(std::string_view text, std::string_view file);

// In LPS. Normals, depths and certainties have no place there.
std::string Fcsv(const LandmarkFile& file);

}  // namespace semblance
