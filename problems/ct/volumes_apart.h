// SPDX-License-Identifier: GPL-3.0-or-later
// The readers of itk_files.h in a process of their own: a file that makes ITK or GDCM end its
// process, or take all memory, is an error that names the file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <stop_token>
#include <vector>

#include "problems/ct/itk_files.h"

namespace semblance {

// As ReadImageVolume.
VoxelArray ReadImageApart(const std::filesystem::path& file, VolumeFormat format,
                          const std::stop_token& stop);

// As ScanDicom.
std::vector<DicomHeader> ScanDicomApart(const std::vector<std::filesystem::path>& files,
                                        const std::stop_token& stop);

// The voxels of slices of one size, one behind the other, as AppendDicomSlice appends them.
VoxelArray ReadSlicesApart(std::span<const DicomHeader> slices, const std::stop_token& stop);

}  // namespace semblance
