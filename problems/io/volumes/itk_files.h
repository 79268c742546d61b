// SPDX-License-Identifier: GPL-3.0-or-later
// Reads and writes files of volumes through ITK and its GDCM. Only itk_files.cc includes these
// libraries. It is built if ITK is installed; otherwise itk_files_off.cc is built, in which every
// function throws. read_volume.cc calls the readers in a child process.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "problems/io/volumes/ct_volume.h"

namespace semblance::problems {

enum class VolumeFormat { kNifti, kNrrd, kMetaImage };

// Reads one volume of grey values from NRRD or MetaImage; ReadNifti reads NIfTI. Throws IoError if
// it cannot be read, InputError for colours and for more than three axes.
VoxelArray ReadImageVolume(const std::filesystem::path& file, VolumeFormat format);

// The tags of a DICOM image that this program uses; an absent tag leaves the default. Texts are as
// in the file.
struct DicomHeader {
  std::filesystem::path file;
  int frame = 0;           // index of the image in its file
  std::string characters;  // character set of the texts
  std::string series_uid, series_number, description, modality, image_type;
  std::string patient_id, patient_name, birth_date, space_uid;
  int rows = -1, columns = -1, frames = 1, instance = -1;
  std::optional<Vec3> position;                   // of the first voxel, LPS, mm
  std::optional<Vec3> along_columns, along_rows;  // unit: from a column, a row, to the next
  std::optional<Vec2> spacing_mm;                 // between columns, between rows
  double slope = kNaN, intercept = kNaN;          // NaN: absent
  double thickness_mm = kNaN, tilt_deg = kNaN;
  std::string lacking;  // names of the tags of its place that are absent
  std::string fault;    // why the image must not be used, e.g. its file ends early
  std::string comma;    // name and text of a tag whose numbers have decimal commas
};

// The headers of the images of a file, none if it is not DICOM ("DICM" after 128 bytes, or its
// elements at once) or holds no image. An image whose pixels are incomplete has a fault.
std::vector<DicomHeader> ScanDicom(const std::filesystem::path& file);

// The values of images, slope and intercept applied, one after the other. Images of one file should
// follow each other, because the file is read for each run of them. Calls `report` with each file.
VoxelArray ReadDicomSlices(std::span<const DicomHeader> slices,
                           const std::function<void(const std::string&)>& report);

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
