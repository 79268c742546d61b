// SPDX-License-Identifier: GPL-3.0-or-later
// Volumes in the files of other programs, as ITK writes them. For tests that link ITK.
#pragma once

// First, else ITK's headers bring a part of an older Eigen of their own.
#include <Eigen/Dense>

#include <fmt/format.h>
#include <itkGDCMImageIO.h>
#include <itkImageIOBase.h>
#include <itkMetaDataObject.h>

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "problems/volumes/ct_volume.h"

namespace semblance::testing {

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

// What a slice of DICOM says beside its voxels.
struct SliceWords {
  std::string series = "1.2.3.1", number = "1", modality = "CT", description = "test";
  std::string compression = "";  // "JPEG" (lossless), "JPEG2000", "RLE"; empty: none
  double slope = 1, intercept = 0;
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

// All slices, their names in an order that is not that of space.
inline void WriteDicom(const std::filesystem::path& folder, const VoxelArray& array,
                       const SliceWords& words = {}) {
  std::filesystem::create_directories(folder);
  for (int k = 0; k < array.counts[2]; ++k) {
    WriteDicomSlice(folder / fmt::format("IM{:03}", (k * 37 + 11) % 101), array, k, words);
  }
}

}  // namespace semblance::testing
