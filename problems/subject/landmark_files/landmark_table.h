// SPDX-License-Identifier: GPL-3.0-or-later
// Landmarks as a table (.csv) with all fields of our own landmark files.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "problems/subject/landmarks.h"

namespace semblance::problems {

// Reads one landmark per row. The columns are found by name, in any order and letter case: the site
// (site, landmark, label or name), x, y, z (also x_mm ...), and optionally normal_x, normal_y,
// normal_z, depth_along_normal_mm, depth_closest_mm, certainty and note. 3D Slicer writes l, p, s
// or r, a, s for x, y, z, which are LPS or RAS; otherwise `axes` is empty, because a table does not
// state them. A row is an absent site if defined, placed, valid or present is 0 (false, no), if
// missing, absent or undefined is 1 (true, yes), or by its position_status (AbsenceReason). The
// separator is a semicolon or a tab if the first line has one, otherwise a comma. Except between
// commas, numbers have a decimal comma if any of them has a comma; commas in texts do not matter.
// Rows without any entry are skipped. `notes` receives the names of all other columns, and those of
// sites that Slicer hides. `file` is the file's name, for messages. Throws IoError with the line
// for any other text.
LandmarkFile ParseLandmarkTable(std::string_view text, std::string_view file,
                                std::vector<std::string>& notes);

// Writes a table with commas, decimal points and all columns. Absent sites are lost.
std::string LandmarkTable(const LandmarkFile& file);

}  // namespace semblance::problems
