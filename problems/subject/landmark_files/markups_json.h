// SPDX-License-Identifier: GPL-3.0-or-later
// Landmarks in 3D Slicer's markups files (.mrk.json).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "problems/subject/landmarks.h"

namespace semblance::problems {

// Reads the control points of all markups of type Fiducial in the file, in order. Names become
// `site`, descriptions `note`; coordinates stay as they are. Lines, curves, planes and other
// markups are left out, with a note; `notes` also receives one on hidden points. `axes` is LPS or
// RAS as the file states. A point that is not placed (positionStatus undefined, missing or preview)
// becomes an absent site, whatever its position. `file` is the file's name, for messages. Throws
// IoError for any other text: no JSON, a repeated or missing key, units other than mm, or markups
// with different axes; and, with the point's number and name, for another status or a position that
// is not three finite numbers.
LandmarkFile ParseMarkupsJson(std::string_view text, std::string_view file,
                              std::vector<std::string>& notes);

// Writes one markup of points in LPS. Normals, depths and certainties are lost.
std::string MarkupsJson(const LandmarkFile& file);

}  // namespace semblance::problems
