// SPDX-License-Identifier: GPL-3.0-or-later
// Reads headers of NRRD and MetaImage files without ITK: the place of the voxels, and the fields
// that ITK ignores.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/io/volumes/ct_volume.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

// Parses the whole text, without blanks around it, as a finite number with a decimal point,
// whatever the locale; nothing if it is none.
std::optional<double> ParseNumber(std::string_view text);

struct HeaderPlace {
  // Columns: from a voxel to the next along each axis, LPS, in the file's unit. Empty: ITK's steps
  // and origin are valid.
  std::optional<Mat3> steps;
  Vec3 origin = Vec3::Zero();       // belongs to `steps`
  double to_mm = 1;                 // factor from the file's unit to mm
  double slope = 1, intercept = 0;  // of the values
  std::vector<std::string> notes;   // assumptions about what the file leaves open
};

// ITK does not provide the steps of an NRRD, because the spaces that it converts to LPS, and the
// axes that it negates, depend on its version: 5.2 negates x of left-anterior-superior instead of
// y, and does not convert spaces with time. Format: https://teem.sourceforge.net/nrrd/format.html.
// Throws InputError, naming `where`, for a space that NRRD does not have, for one that would be a
// mirror image in LPS, and for directions that are not three vectors.
HeaderPlace ParseNrrdPlace(std::string_view head, const std::string& where);

// ITK provides the steps of a MetaImage in LPS, but ignores their unit, the slope of the values and
// AnatomicalOrientation, and reads each number up to its first odd character ("8,9" as 8). Throws
// InputError, naming `where` and the field, for a field that MetaImage does not allow. Format:
// https://itk.org/Wiki/ITK/MetaIO/Documentation.
HeaderPlace ParseMetaImagePlace(std::string_view head, const std::string& where);

// True if the header states that its voxels are compressed.
bool IsCompressedMetaImage(std::string_view head);

// True if the file is only a header (.nhdr, .mhd, .hdr) and the voxels are in another file.
bool HasDetachedVoxels(const std::filesystem::path& file);

// Moves the voxels to the place of the header, and appends its notes.
void ApplyPlace(const HeaderPlace& place, VoxelArray& array);

}  // namespace semblance::problems
