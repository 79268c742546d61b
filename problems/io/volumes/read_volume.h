// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a volume from any supported file or folder.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "problems/io/volumes/ct_volume.h"
#include "problems/io/volumes/itk_files.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

struct ReadVolumeOptions {
  std::string series;        // UID or number in a DICOM folder; empty if there is only one series
  bool fill_slices = false;  // interpolates missing slices, and uses the first of doubled slices
};

// The kind of values; kUnknown if the file does not state it, then Hounsfield units are expected.
enum class Modality { kUnknown, kCt, kMr };

struct VolumeReading {
  CtVolume volume;
  Modality modality = Modality::kUnknown;
  std::vector<std::string> notes;  // for people: how the volume was read, a line each
};

// Reads a folder of DICOM files (with its sub-folders), NIfTI (.nii, .nii.gz), NRRD (.nrrd, .nhdr),
// MetaImage (.mha, .mhd) or an InVesalius project (.inv3). DICOM slices are sorted along their
// normal; those of a tilted gantry make skew axes, and nothing is resampled. ITK and GDCM read in a
// child process, because some damaged files make them end the process. Throws IoError or InputError
// with one line for what cannot be used, and with a line for each series if several match. Throws
// Cancelled soon after a stop is requested.
VolumeReading ReadVolume(const std::filesystem::path& path, const ReadVolumeOptions& options,
                         const RunContext& context);

// A series of a DICOM folder, for a person who chooses one.
struct VolumeSeries {
  std::string name;  // for ReadVolumeOptions::series
  std::string description, modality;
  int slices = 0, columns = 0, rows = 0;
};

// The series of a DICOM folder with at least two slices, those with the most slices first; none for
// a file. Throws as ReadVolume.
std::vector<VolumeSeries> ListSeries(const std::filesystem::path& path, const RunContext& context);

// The format of a file with a whole volume, by the ending of its name; empty for other endings.
std::optional<VolumeFormat> FindVolumeFormat(const std::filesystem::path& file);

// The files that ReadVolume reads: the path itself and, if it is only a header (.mhd, .nhdr), the
// files of the voxels that it names, which need not exist; or all files below the folder, sorted.
std::vector<std::filesystem::path> VolumeFiles(const std::filesystem::path& path);

}  // namespace semblance::problems
