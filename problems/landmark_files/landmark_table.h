// SPDX-License-Identifier: GPL-3.0-or-later
// Landmarks as a table (.csv), with all that our own files say of one.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "problems/subject/landmarks.h"

namespace semblance {

// A landmark per row. The columns are found by name, in any order and letter case: the site (site,
// landmark, label or name), x, y, z (also x_mm ...), and, where there are any, normal_x, normal_y,
// normal_z, depth_along_normal_mm, depth_closest_mm, certainty, note. The separator is a comma, or
// a semicolon if the first line has one; numbers then have a decimal comma if any of them has a
// comma, whatever commas stand in texts. `axes` is empty, for a table does not say. ignored: gets
// the names of all other columns. file: its name, for messages. Throws IoError with the line for
// anything else.
LandmarkFile ParseLandmarkTable(std::string_view text, std::string_view file,
                                std::vector<std::string>& ignored);

// With commas, decimal points and all columns. Absent sites have no place there.
std::string LandmarkTable(const LandmarkFile& file);

}  // namespace semblance
