// SPDX-License-Identifier: GPL-3.0-or-later
// Reads and writes files through ITK and its GDCM. Only itk_files.cc includes these libraries. It
// is built if ITK is installed; otherwise itk_files_off.cc is built, in which every function
// throws. read_volume.cc calls the readers in a child process.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/io/volumes/ct_volume.h"

namespace semblance::problems {

enum class VolumeFormat { kNifti, kNrrd, kMetaImage };

// Reads one volume of grey values. Throws IoError if it cannot be read, InputError for colours and
// for more than three axes.
VoxelArray ReadImageVolume(const std::filesystem::path& file, VolumeFormat format);

// The tags of a DICOM file that this program uses; an absent tag leaves the default.
struct DicomHeader {
  std::filesystem::path file;
  std::string series_uid, series_number, description, modality, image_type;
  int rows = -1, columns = -1, frames = 1;
  std::optional<Vec3> position;                   // of the first voxel, LPS, mm
  std::optional<Vec3> along_columns, along_rows;  // unit: from a column, a row, to the next
  std::optional<Vec2> spacing_mm;                 // between columns, between rows
};

// The headers of those files that are DICOM ("DICM" after 128 bytes), in the given order.
std::vector<DicomHeader> ScanDicom(const std::vector<std::filesystem::path>& files);

// Appends the values of one slice of header.columns x header.rows, slope and intercept applied.
void AppendDicomSlice(const DicomHeader& header, VoxelArray& array);

// The tags that EncodeDicomSlice writes in addition to the voxels and their place.
struct DicomSeriesNames {
  std::string patient, description;
  std::uint64_t number = 1;  // part of all UIDs: another number makes another study
};

// The bytes of a DICOM file (CT image, 16 bit, uncompressed) with one slice of the volume.
std::string EncodeDicomSlice(const CtVolume& volume, int slice, const DicomSeriesNames& names);

// Writes the volume (16 bit, with its place in space) to one file. The ending of the file's name
// must be one of the format. Throws IoError if it cannot be written.
void WriteImageVolume(const CtVolume& volume, const std::filesystem::path& file,
                      VolumeFormat format);

}  // namespace semblance::problems
