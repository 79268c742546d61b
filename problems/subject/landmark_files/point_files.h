// SPDX-License-Identifier: GPL-3.0-or-later
// Landmarks in the point files of other programs: 3D Slicer's older fiducial lists (.fcsv),
// MeshLab's picked points (.pp) and CloudCompare's point lists (.txt, .asc). In every parser `file`
// is the file's name, for messages.
#pragma once

#include <string>
#include <string_view>

#include "problems/subject/landmarks.h"

namespace semblance::problems {

// Reads a fiducial list. Labels become `site`, descriptions `note`; coordinates stay as they are.
// `axes` is LPS or RAS as the header states (old files have numbers: 0 is RAS, 1 is LPS). Throws
// IoError with the line for any other text: no axes, no columns x, y, z and label, or a coordinate
// that is not a finite number.
LandmarkFile ParseFcsv(std::string_view text, std::string_view file);

// Writes a fiducial list in LPS. Normals, depths and certainties are lost.
std::string Fcsv(const LandmarkFile& file);

// Reads MeshLab's PickedPoints. Names become `site`; coordinates stay as they are. `axes` is empty,
// because the file does not state them. A point that is not active becomes an absent site, whatever
// its coordinates. Throws IoError for any other text: no XML, another root, or a coordinate that is
// missing or not a finite number, with the point's number and name.
LandmarkFile ParseMeshLabPoints(std::string_view text, std::string_view file);

// Writes PickedPoints. Normals, depths, certainties and notes are lost.
std::string MeshLabPoints(const LandmarkFile& file);

// Reads CloudCompare's list of picked points: per line a name and three coordinates, separated by
// commas, semicolons or blanks, as in its export "label, x, y, z". `axes` is empty. A separator at
// the end of a line is allowed. Throws IoError with the line for any other text; the message names
// a missing name or an empty entry.
LandmarkFile ParsePointList(std::string_view text, std::string_view file);

}  // namespace semblance::problems
