// SPDX-License-Identifier: GPL-3.0-or-later
// Reads NIfTI-1 and NIfTI-2 files without a library: ITK's library replaces values that are not
// numbers by 0 (soft tissue), refuses skew axes and small units, and trusts the header too much.
// Formats: https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h and .../doc/nifti2.h.
#pragma once

#include <filesystem>

#include "problems/io/volumes/ct_volume.h"

namespace semblance::problems {

// The file with the voxels of a NIfTI header: the file itself, or for NAME.hdr the file NAME.img or
// NAME.img.gz.
std::filesystem::path NiftiVoxelFile(const std::filesystem::path& file);

// Reads one volume of grey values, its slope and intercept applied. The sform places the voxels;
// the qform does if there is no sform, if the sform is that of a standard space (which scales the
// head), or if the sform contradicts the size of the voxels. Notes: a qform that disagrees, units
// other than mm, skew axes, an intent. Throws IoError for a file that is cut short or no NIfTI, and
// InputError for colours, for several volumes, and for places that are contradictory.
VoxelArray ReadNifti(const std::filesystem::path& file);

}  // namespace semblance::problems
