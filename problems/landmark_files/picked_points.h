// SPDX-License-Identifier: GPL-3.0-or-later
// Landmarks as MeshLab and CloudCompare save picked points.
#pragma once

#include <string>
#include <string_view>

#include "problems/subject/landmarks.h"

namespace semblance {

// MeshLab's PickedPoints (.pp): names as `site`, coordinates as they stand; `axes` is empty, for
// the file does not say. A point that is not active becomes an absent one, whatever its
// coordinates. file: its name, for messages. Throws IoError for anything else: no XML, another
// root, a coordinate that is missing or is not a finite number, with the point's number and name.
LandmarkFile ParseMeshLabPoints(std::string_view text, std::string_view file);

// Normals, depths, certainties and notes have no place there.
std::string MeshLabPoints(const LandmarkFile& file);

// CloudCompare's list of picked points (.txt, .asc): per line a name and three coordinates, between
// commas, semicolons or blanks, as its export "label, x, y, z" has it. Likewise without axes.
// What follows a last separator may be empty. Throws IoError with the line for anything else; where
// a point has no name or an entry is empty, it says so.
LandmarkFile ParsePointList(std::string_view text, std::string_view file);

}  // namespace semblance
