// SPDX-License-Identifier: GPL-3.0-or-later
// What a NIfTI-1 file, gzipped or not, says of itself; its library believes too much. The form:
// https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h. All throw IoError, naming the file,
// where it cannot be unpacked, and leave it to the library to say that it is shorter than a header.
#pragma once

#include <filesystem>

namespace semblance {

// Throws InputError if one of the numbers that say how the voxels lie is none, or is farther than
// any voxel.
void CheckNiftiPlaces(const std::filesystem::path& file);

// Whether there is a quaternion or a matrix, else there are but the steps along the axes.
bool NiftiSaysHowItLies(const std::filesystem::path& file);

// Throws IoError unless so many voxels are behind the header, each of the type in which it is
// stored, which is not that in which the library gives it where there is a slope.
void CheckNiftiWhole(const std::filesystem::path& file, double voxels);

}  // namespace semblance
