// SPDX-License-Identifier: GPL-3.0-or-later
// Files that ITK and its GDCM read and write. The only place where the project knows of them:
// itk_files.cc where they are installed, itk_files_off.cc, where each of these throws, elsewhere.
// The readers are called in a process of their own (itk_files_apart.cc).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "problems/volumes/ct_volume.h"
#include "problems/volumes/voxel_array.h"

namespace semblance {

enum class VolumeFormat { kNifti, kNrrd, kMetaImage };

// Reads one volume of grey values. Throws IoError if it cannot be read, InputError for colours and
// for more than three axes.
VoxelArray ReadImageVolume(const std::filesystem::path& file, VolumeFormat format);

// What a DICOM file says of itself; empty where it says nothing.
struct DicomHeader {
  std::filesystem::path file;
  std::string series_uid, series_number, description, modality, image_type;
  int rows = -1, columns = -1, frames = 1;
  std::optional<Vec3> position;                   // of the first voxel, LPS, mm
  std::optional<Vec3> along_columns, along_rows;  // unit: from a column, a row, to the next
  std::optional<Vec2> spacing_mm;                 // between columns, between rows
};

// Of those of the files that are DICOM (with its mark behind 128 bytes), in the order given.
std::vector<DicomHeader> ScanDicom(const std::vector<std::filesystem::path>& files);

// Appends the values of one slice of header.columns x header.rows, slope and intercept applied.
void AppendDicomSlice(const DicomHeader& header, VoxelArray& array);

// The readers in a process of their own: a file that makes ITK or GDCM end its process, or take all
// memory, is an IoError that names the file. Throw Cancelled soon after a stop is asked for.

// As ReadImageVolume.
VoxelArray ReadImageApart(const std::filesystem::path& file, VolumeFormat format,
                          const std::stop_token& stop);

// As ScanDicom.
std::vector<DicomHeader> ScanDicomApart(const std::vector<std::filesystem::path>& files,
                                        const std::stop_token& stop);

// The voxels of slices of one size, one behind the other, as AppendDicomSlice appends them.
VoxelArray ReadSlicesApart(std::span<const DicomHeader> slices, const std::stop_token& stop);

// What is written into the files of a series beside the voxels.
struct DicomSeriesNames {
  std::string patient, description;
  std::uint64_t number = 1;  // of all UIDs: another number, another study
};

// The bytes of a DICOM file (CT image, 16 bit, uncompressed) with one slice of the volume.
std::string EncodeDicomSlice(const CtVolume& volume, int slice, const DicomSeriesNames& names);

// The volume (16 bit, with its place in space) in one file whose name's ending is of the format.
// Throws IoError if it cannot be written.
void WriteImageVolume(const CtVolume& volume, const std::filesystem::path& file,
                      VolumeFormat format);

}  // namespace semblance
