// SPDX-License-Identifier: GPL-3.0-or-later
// A phantom's head in every kind of volume file, written by ITK or by hand, and read back. For
// tests that link ITK.
#pragma once

#include <Eigen/Dense>  // before ITK, which includes a part of an older Eigen

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <itkGDCMImageIO.h>
#include <itkImageIOBase.h>
#include <itkMetaDataObject.h>
#include <itkNiftiImageIO.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "problems/io/volumes/ct_volume.h"
#include "problems/io/volumes/import_ct.h"
#include "problems/io/volumes/itk_files.h"
#include "problems/io/volumes/read_volume.h"
#include "problems/subject/phantom_ct.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::testing {
using namespace problems;

inline void SetGeometry(const std::array<int, 3>& counts, const Vec3& origin, const Mat3& steps,
                        itk::ImageIOBase& io) {
  io.SetNumberOfDimensions(3);
  itk::ImageIORegion region(3);
  for (unsigned axis = 0; axis < 3; ++axis) {
    const Vec3 step = steps.col(axis);
    const Vec3 unit = step.normalized();
    io.SetDimensions(axis, counts[axis]);
    io.SetOrigin(axis, origin[axis]);
    io.SetSpacing(axis, step.norm());
    io.SetDirection(axis, std::vector<double>{unit.x(), unit.y(), unit.z()});
    region.SetIndex(axis, 0);
    region.SetSize(axis, counts[axis]);
  }
  io.SetIORegion(region);
  io.SetPixelType(itk::IOPixelEnum::SCALAR);
  io.SetNumberOfComponents(1);
}

template <class Value = std::int16_t>
void WriteItk(const std::filesystem::path& path, const VoxelArray& array, itk::ImageIOBase& io) {
  SetGeometry(array.counts, array.origin, array.steps, io);
  io.SetComponentType(itk::ImageIOBase::MapPixelType<Value>::CType);
  io.SetFileName(path.string());
  const std::vector<Value> values(array.values.begin(), array.values.end());
  io.Write(values.data());
}

// The attributes of a DICOM slice besides its voxels.
struct SliceWords {
  std::string series = "1.2.3.1", number = "1", modality = "CT", description = "test";
  std::string compression = "";  // "JPEG" (lossless), "JPEG2000", "RLE"; empty: none
  double slope = 1, intercept = 0;
  std::vector<std::pair<std::string, std::string>> more = {};  // tags, e.g. "0010|0020", and texts
};

// Slice k of the array as a file of its own.
inline void WriteDicomSlice(const std::filesystem::path& path, const VoxelArray& array, int k,
                            const SliceWords& words) {
  const auto io = itk::GDCMImageIO::New();
  SetGeometry({array.counts[0], array.counts[1], 1}, array.origin + k * array.steps.col(2),
              array.steps, *io);
  itk::MetaDataDictionary& tags = io->GetMetaDataDictionary();
  const auto put = [&](const char* tag, const std::string& text) {
    itk::EncapsulateMetaData<std::string>(tags, tag, text);
  };
  put("0008|0060", words.modality);
  put("0008|103e", words.description);
  put("0020|000d", "1.2.3");
  put("0020|000e", words.series);
  put("0020|0011", words.number);
  put("0020|0013", fmt::format("{}", k + 1));
  put("0028|1052", fmt::format("{}", words.intercept));
  put("0028|1053", fmt::format("{}", words.slope));
  for (const auto& [tag, text] : words.more) {
    put(tag.c_str(), text);
  }
  io->KeepOriginalUIDOn();
  if (!words.compression.empty()) {
    io->UseCompressionOn();
    io->SetCompressor(words.compression);
  }
  io->SetComponentType(itk::IOComponentEnum::SHORT);
  io->SetFileName(path.string());
  const std::size_t size = static_cast<std::size_t>(array.counts[0]) * array.counts[1];
  io->Write(array.values.data() + k * size);
}

// All slices, with names whose order differs from the order in space.
inline void WriteDicom(const std::filesystem::path& folder, const VoxelArray& array,
                       const SliceWords& words = {}) {
  std::filesystem::create_directories(folder);
  for (int k = 0; k < array.counts[2]; ++k) {
    WriteDicomSlice(folder / fmt::format("IM{:03}", (k * 37 + 11) % 101), array, k, words);
  }
}

namespace fs = std::filesystem;

struct HeadVolume {
  Phantom phantom = MakePhantom({.rings = 40});
  CtVolume volume = VoxelisePhantom(phantom, {.pixel_mm = 2.5, .slice_mm = 3.5});
};

inline const HeadVolume& TheHead() {
  static const HeadVolume head;
  return head;
}

inline VoxelArray ArrayOf(const CtVolume& volume) {
  VoxelArray array;
  array.counts = {volume.columns, volume.rows, volume.slices};
  array.origin = volume.origin;
  array.steps = volume.axes * volume.spacing_mm.asDiagonal();
  array.values = volume.values;
  return array;
}

// The same voxels in another order of a file: sagittal slices, rows from above, from left to right.
inline VoxelArray SagittalArrayOf(const CtVolume& v) {
  VoxelArray array;
  array.counts = {v.rows, v.slices, v.columns};
  array.origin = v.World(v.columns - 1, 0, v.slices - 1);
  array.steps << v.spacing_mm.y() * v.axes.col(1), -v.spacing_mm.z() * v.axes.col(2),
      -v.spacing_mm.x() * v.axes.col(0);
  for (int i = v.columns - 1; i >= 0; --i) {
    for (int k = v.slices - 1; k >= 0; --k) {
      for (int j = 0; j < v.rows; ++j) {
        array.values.push_back(v.values[v.Index(i, j, k)]);
      }
    }
  }
  return array;
}

// The values sampled on another grid in space.
inline CtVolume Resampled(const CtVolume& from, CtVolume to) {
  to.values.resize(to.Index(0, 0, to.slices));
  for (int k = 0; k < to.slices; ++k) {
    for (int j = 0; j < to.rows; ++j) {
      for (int i = 0; i < to.columns; ++i) {
        to.values[to.Index(i, j, k)] = static_cast<std::int16_t>(SampleHu(from, to.World(i, j, k)));
      }
    }
  }
  return to;
}

// The bytes of values in memory, which are little-endian.
template <class Value>
std::string BytesOf(const std::vector<Value>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)};
}

template <class Value>
void PutAt(std::size_t at, Value value, std::string& bytes) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

// Compresses bytes to a gzip stream of one member.
inline std::string Gzipped(const std::string& bytes) {
  std::string packed(bytes.size() + 1000, ' ');
  std::size_t used = 0;
  archive* a = archive_write_new();
  archive_write_add_filter_gzip(a);
  archive_write_set_format_raw(a);
  archive_write_set_bytes_in_last_block(a, 1);
  archive_write_open_memory(a, packed.data(), packed.size(), &used);
  archive_entry* entry = archive_entry_new();
  archive_entry_set_filetype(entry, AE_IFREG);
  archive_write_header(a, entry);
  archive_write_data(a, bytes.data(), bytes.size());
  archive_entry_free(entry);
  archive_write_free(a);
  packed.resize(used);
  return packed;
}

// The header of an NRRD file in the space LPS.
inline std::string LpsDirections(const VoxelArray& a, const Vec3& to_space, const char* more = "") {
  std::string directions;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 step = to_space.cwiseProduct(a.steps.col(axis));
    directions += fmt::format("({},{},{}{}) ", step.x(), step.y(), step.z(), more);
  }
  const Vec3 origin = to_space.cwiseProduct(a.origin);
  return fmt::format("space directions: {}\nspace origin: ({},{},{}{})\n", directions, origin.x(),
                     origin.y(), origin.z(), more);
}

class VolumeFilesTest : public ::testing::Test {
 protected:
  VolumeReading Read(const fs::path& name, const ReadVolumeOptions& options = {}) const {
    return ReadVolume(folder_ / name, options, {});
  }
  std::string Words(const fs::path& name, const ReadVolumeOptions& options = {}) const {
    return WordsOf<Error>([&] { Read(name, options); });
  }

  // Checks that the read volume equals the written one, at the same places.
  void ExpectTheHead(const VolumeReading& reading) const {
    const CtVolume& read = reading.volume;
    ASSERT_EQ(read.columns, head_.volume.columns);
    ASSERT_EQ(read.rows, head_.volume.rows);
    ASSERT_EQ(read.slices, head_.volume.slices);
    EXPECT_EQ(read.values, head_.volume.values);
    for (const Vec3& at : {Vec3(0, 0, 0), Vec3(read.columns, read.rows, read.slices)}) {
      EXPECT_LT(
          (read.World(at.x(), at.y(), at.z()) - head_.volume.World(at.x(), at.y(), at.z())).norm(),
          1e-3);
    }
  }

  void WriteNrrd(const std::string& name, const std::string& lines) const {
    WriteFileAtomically(
        folder_ / name,
        fmt::format("NRRD0004\ntype: short\ndimension: 3\nsizes: {}\n{}endian: little\nencoding: "
                    "raw\n\n{}",
                    fmt::join(array_.counts, " "), lines, BytesOf(array_.values)));
  }
  void WriteMetaImage(const std::string& name, const std::string& lines) const {
    WriteFileAtomically(
        folder_ / name,
        fmt::format("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = "
                    "False\n{}DimSize = {}\nElementType = MET_SHORT\nElementDataFile = LOCAL\n{}",
                    lines, fmt::join(array_.counts, " "), BytesOf(array_.values)));
  }
  std::string NiftiBytes() const {
    WriteItk(folder_ / "plain.nii", array_, *itk::NiftiImageIO::New());
    return ReadFileBytes(folder_ / "plain.nii");
  }

  // Checks that the skull of the read volume lies within half a voxel of the phantom's outer side.
  void ExpectTheSkull(const CtVolume& volume) const {
    const TriMesh skull = ImportCt(volume, {.bone_hu = 520}, {}).skull;
    const MeshQuery query(skull);
    double furthest = 0, sum = 0;
    for (const Vec3& p : head_.phantom.skull.points) {
      const double off = query.Closest(p).distance_mm;
      furthest = std::max(furthest, off);
      sum += off;
    }
    EXPECT_LT(furthest, 0.5 * volume.spacing_mm.norm());
    EXPECT_LT(sum / static_cast<double>(head_.phantom.skull.points.size()),
              0.25 * volume.spacing_mm.minCoeff());
  }

  const HeadVolume& head_ = TheHead();
  VoxelArray array_ = ArrayOf(head_.volume);
  ScratchFolder folder_;
};

}  // namespace semblance::testing
