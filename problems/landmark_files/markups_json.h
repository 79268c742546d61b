// SPDX-License-Identifier: GPL-3.0-or-later
// Landmarks in 3D Slicer's markups files (.mrk.json).
#pragma once

#include <string>
#include <string_view>

#include "problems/subject/landmarks.h"

namespace semblance {

// The control points of all markups in the file, in order: names as `site`, descriptions as `note`,
// coordinates as they stand; `axes` is LPS or RAS as the file says. A point that is not placed
// (positionStatus undefined, missing or preview) becomes an absent one, whatever its position.
// file: its name, for messages. Throws IoError for anything but such a file: no JSON, a key that is
// repeated or lacks, units other than mm, markups with different axes; of a point, which is named:
// another status, a position that is not three finite numbers.
LandmarkFile ParseMarkupsJson(std::string_view text, std::string_view file);

// One markup of points in LPS. Normals, depths and certainties have no place there.
std::string MarkupsJson(const LandmarkFile& file);

}  // namespace semblance
