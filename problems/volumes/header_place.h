// SPDX-License-Identifier: GPL-3.0-or-later
// How the voxels of an NRRD or a MetaImage lie, as the text at the file's beginning says it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/volumes/voxel_array.h"
#include "surfaces/base/geometry.h"

namespace semblance {

struct HeaderPlace {
  std::optional<Mat3> steps;   // columns: along each axis, LPS, in the file's unit; else ITK's hold
  Vec3 origin = Vec3::Zero();  // with these steps
  double to_mm = 1;            // what a length in the file is times
  std::vector<std::string> notes;  // what the file leaves open, and how it is taken
};

// ITK is not asked for the steps, for which spaces it turns to LPS, and which axis of them, depends
// on its version: 5.2 turns x of left-anterior-superior instead of y, and leaves spaces with time
// as they are. The form: https://teem.sourceforge.net/nrrd/format.html. Throws InputError, naming
// `where`, for a space that NRRD does not have, one that would be a mirror image in LPS, and
// directions that are not three vectors.
HeaderPlace PlaceOfNrrd(std::string_view head, const std::string& where);

// ITK knows the steps, which are in LPS, and does not look at their unit.
HeaderPlace PlaceOfMetaImage(std::string_view head);

// Puts the voxels where the header says, and appends its notes.
void TakePlace(const HeaderPlace& place, VoxelArray& array);

}  // namespace semblance
