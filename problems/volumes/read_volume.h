// SPDX-License-Identifier: GPL-3.0-or-later
// A volume from whatever file or folder holds one.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "problems/volumes/ct_volume.h"
#include "problems/volumes/itk_files.h"
#include "surfaces/base/run_context.h"

namespace semblance {

struct ReadVolumeOptions {
  std::string series;        // of a DICOM folder: UID or number; empty where there is only one
  bool fill_slices = false;  // missing slices are interpolated, of doubled ones the first is taken
};

// What the voxels' values are: kUnknown where the file does not say; Hounsfield units are expected.
enum class Modality { kUnknown, kCt, kMr };

struct VolumeReading {
  CtVolume volume;
  Modality modality = Modality::kUnknown;
  std::vector<std::string> notes;  // what people should know of how it was read, a line each
};

// A folder of DICOM files (also in folders within it), NIfTI (.nii, .nii.gz), NRRD (.nrrd, .nhdr),
// MetaImage (.mha, .mhd) or an InVesalius project (.inv3). Slices of DICOM are sorted along their
// normal; those of a tilted gantry make skew axes, and nothing is resampled. Throws IoError or
// InputError with one clear line for what cannot be used, and with a line for each series where
// several could be meant.
VolumeReading ReadVolume(const std::filesystem::path& path, const ReadVolumeOptions& options,
                         const RunContext& context);

// Of a file with a whole volume, by its name's ending; nothing for other endings.
std::optional<VolumeFormat> VolumeFormatOf(const std::filesystem::path& file);

// The files that ReadVolume looks at: the path itself, or what is in the folder, sorted.
std::vector<std::filesystem::path> VolumeFiles(const std::filesystem::path& path);

}  // namespace semblance
