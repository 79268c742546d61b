// SPDX-License-Identifier: GPL-3.0-or-later
// Landmarks in the point files of other programs: 3D Slicer's older fiducial lists (.fcsv),
// MeshLab's picked points (.pp) and CloudCompare's point lists (.txt, .asc). In every parser `file`
// is the file's name, for messages.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "problems/subject/landmarks.h"

namespace semblance::problems {

// The reason why a point has no position, from Slicer's status: undefined (0), preview (1), defined
// (2) or missing (3); empty for a defined point. Throws IoError, without the file's name, for
// another status.
std::string AbsenceReason(std::string_view status);

// Adds a note on sites whose points are hidden or not selected in Slicer; none if there is no site.
void NoteHidden(std::string_view file, const std::vector<std::string>& sites,
                std::vector<std::string>& notes);

// Reads a fiducial list. Labels become `site`, descriptions `note`; coordinates stay as they are.
// Slicer 5.2 and later add one or two cells to each row that the header does not name; the first is
// the point's status, and a point that is not defined becomes an absent site, whatever its
// coordinates. `axes` is LPS or RAS as the header states (old files have numbers: 0 is RAS, 1 is
// LPS), or empty, as in files of Slicer 3. `notes` receives a note on hidden points. Throws IoError
// with the line for any other text: no columns x, y, z and label, more cells than the header
// explains, or a coordinate that is not a finite number.
LandmarkFile ParseFcsv(std::string_view text, std::string_view file,
                       std::vector<std::string>& notes);

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
