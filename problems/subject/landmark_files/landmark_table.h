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
// normal_z, depth_along_normal_mm, depth_closest_mm, certainty and note. The separator is a comma,
// or a semicolon if the first line has one. With semicolons, numbers have a decimal comma if any of
// them has a comma; commas in texts do not matter. `axes` is empty, because a table does not state
// them. `ignored` receives the names of all other columns. `file` is the file's name, for messages.
// Throws IoError with the line for any other text.
LandmarkFile ParseLandmarkTable(std::string_view text, std::string_view file,
                                std::vector<std::string>& ignored);

// Writes a table with commas, decimal points and all columns. Absent sites are lost.
std::string LandmarkTable(const LandmarkFile& file);

}  // namespace semblance::problems
