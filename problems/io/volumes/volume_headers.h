// SPDX-License-Identifier: GPL-3.0-or-later
// Reads headers of NRRD, MetaImage and NIfTI-1 files without ITK: the place of the voxels, and the
// faults that ITK does not notice.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/io/volumes/ct_volume.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

struct HeaderPlace {
  // Columns: from a voxel to the next along each axis, LPS, in the file's unit. Empty: ITK's steps
  // and origin are valid.
  std::optional<Mat3> steps;
  Vec3 origin = Vec3::Zero();      // belongs to `steps`
  double to_mm = 1;                // factor from the file's unit to mm
  std::vector<std::string> notes;  // assumptions about what the file leaves open
};

// ITK does not provide the steps of an NRRD, because the spaces that it converts to LPS, and the
// axes that it negates, depend on its version: 5.2 negates x of left-anterior-superior instead of
// y, and does not convert spaces with time. Format: https://teem.sourceforge.net/nrrd/format.html.
// Throws InputError, naming `where`, for a space that NRRD does not have, for one that would be a
// mirror image in LPS, and for directions that are not three vectors.
HeaderPlace ParseNrrdPlace(std::string_view head, const std::string& where);

// ITK provides the steps of a MetaImage in LPS, but ignores their unit.
HeaderPlace ParseMetaImagePlace(std::string_view head);

// True if the file is only a header (.nhdr, .mhd, .hdr) and the voxels are in another file.
bool HasDetachedVoxels(const std::filesystem::path& file);

// Moves the voxels to the place of the header, and appends its notes.
void ApplyPlace(const HeaderPlace& place, VoxelArray& array);

// NIfTI-1, gzipped or not. ITK's NIfTI library trusts the header too much. Format:
// https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h. The three functions throw IoError,
// naming the file, if it cannot be unpacked. They accept a file that is shorter than a header,
// because the library reports that.

// Throws InputError if one of the numbers that place the voxels is not finite, or beyond 1e9 mm.
void CheckNiftiPlace(const std::filesystem::path& file);

// True if there is a quaternion or a matrix; otherwise there are only the steps along the axes.
bool NiftiHasPlace(const std::filesystem::path& file);

// Throws IoError unless the file holds this number of voxels behind its header. Counts the size of
// a voxel as stored in the file; ITK's size differs if there is a slope.
void CheckNiftiWhole(const std::filesystem::path& file, double voxels);

}  // namespace semblance::problems
