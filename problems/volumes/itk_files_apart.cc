// SPDX-License-Identifier: GPL-3.0-or-later
// The readers of itk_files.h in a process of their own.
#include <algorithm>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "problems/volumes/apart.h"
#include "problems/volumes/itk_files.h"
#include "surfaces/base/geometry.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

// Beside what the voxels need.
constexpr double kWork_bytes = 512e6;

// ---------------------------------------------------------------------------------------------
// Values as bytes, and back; both are of one program.
// ---------------------------------------------------------------------------------------------

template <class Value>
void Put(std::string& bytes, const Value& value) {
  static_assert(std::is_trivially_copyable_v<Value>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class Value>
void Take(std::string_view& bytes, Value& value) {
  std::memcpy(&value, bytes.data(), sizeof value);
  bytes.remove_prefix(sizeof value);
}

void Put(std::string& bytes, const std::string& text) {
  Put(bytes, text.size());
  bytes += text;
}

void Take(std::string_view& bytes, std::string& text) {
  std::size_t size = 0;
  Take(bytes, size);
  text = bytes.substr(0, size);
  bytes.remove_prefix(size);
}

void Put(std::string& bytes, const std::vector<std::string>& texts) {
  Put(bytes, texts.size());
  for (const std::string& text : texts) {
    Put(bytes, text);
  }
}

void Take(std::string_view& bytes, std::vector<std::string>& texts) {
  std::size_t count = 0;
  Take(bytes, count);
  texts.resize(count);
  for (std::string& text : texts) {
    Take(bytes, text);
  }
}

template <int rows, int columns>
void Put(std::string& bytes, const Eigen::Matrix<double, rows, columns>& matrix) {
  bytes.append(reinterpret_cast<const char*>(matrix.data()), sizeof(double) * rows * columns);
}

template <int rows, int columns>
void Take(std::string_view& bytes, Eigen::Matrix<double, rows, columns>& matrix) {
  std::memcpy(matrix.data(), bytes.data(), sizeof(double) * rows * columns);
  bytes.remove_prefix(sizeof(double) * rows * columns);
}

template <class Value>
void Put(std::string& bytes, const std::optional<Value>& value) {
  Put(bytes, value.has_value());
  Put(bytes, value.value_or(Value(Value::Zero())));
}

template <class Value>
void Take(std::string_view& bytes, std::optional<Value>& value) {
  bool is_there = false;
  Value there = Value::Zero();
  Take(bytes, is_there);
  Take(bytes, there);
  value = is_there ? std::optional(there) : std::nullopt;
}

// Calls `visit` with each member.
template <class Header, class Visit>
void VisitMembers(Header& header, const Visit& visit) {
  for (auto* text : {&header.series_uid, &header.series_number, &header.description,
                     &header.modality, &header.image_type}) {
    visit(*text);
  }
  for (auto* number : {&header.rows, &header.columns, &header.frames}) {
    visit(*number);
  }
  for (auto* place : {&header.position, &header.along_columns, &header.along_rows}) {
    visit(*place);
  }
  visit(header.spacing_mm);
}

std::string BytesOf(const VoxelArray& array) {
  std::string bytes;
  Put(bytes, array.counts);
  Put(bytes, array.origin);
  Put(bytes, array.steps);
  Put(bytes, array.clipped);
  Put(bytes, array.not_finite);
  Put(bytes, array.notes);
  bytes.append(reinterpret_cast<const char*>(array.values.data()),
               array.values.size() * sizeof array.values[0]);
  return bytes;
}

VoxelArray ArrayOf(std::string_view bytes) {
  VoxelArray array;
  Take(bytes, array.counts);
  Take(bytes, array.origin);
  Take(bytes, array.steps);
  Take(bytes, array.clipped);
  Take(bytes, array.not_finite);
  Take(bytes, array.notes);
  array.values.resize(bytes.size() / sizeof array.values[0]);
  std::memcpy(array.values.data(), bytes.data(), bytes.size());
  return array;
}

// What a file can hold however it is packed, three times: as read, as voxels, as sent. Those of a
// detached header lie elsewhere.
double MemoryFor_bytes(const fs::path& file) {
  constexpr double kMostPacked = 1032, kMostVolume_bytes = 8e9, kCopies = 3;
  const std::string ending = file.extension().string();
  std::error_code fault;
  const auto size = static_cast<double>(fs::file_size(file, fault));
  const bool is_all = !fault && ending != ".nhdr" && ending != ".mhd" && ending != ".hdr";
  return kWork_bytes +
         kCopies * (is_all ? std::min(kMostPacked * size, kMostVolume_bytes) : kMostVolume_bytes);
}

}  // namespace

VoxelArray ReadImageApart(const fs::path& file, VolumeFormat format, const std::stop_token& stop) {
  return ArrayOf(DoApart(
      [&](const TellFile& tell) {
        tell(file.string());
        return BytesOf(ReadImageVolume(file, format));
      },
      MemoryFor_bytes(file), stop));
}

std::vector<DicomHeader> ScanDicomApart(const std::vector<fs::path>& files,
                                        const std::stop_token& stop) {
  const std::string bytes = DoApart(
      [&](const TellFile& tell) {
        std::string headers;
        for (std::size_t n = 0; n < files.size(); ++n) {
          tell(files[n].string());
          for (const DicomHeader& header : ScanDicom({files[n]})) {
            Put(headers, n);
            VisitMembers(header, [&](const auto& member) { Put(headers, member); });
          }
        }
        return headers;
      },
      kWork_bytes, stop);
  std::vector<DicomHeader> headers;
  for (std::string_view rest = bytes; !rest.empty();) {
    std::size_t n = 0;
    Take(rest, n);
    DicomHeader& header = headers.emplace_back();
    header.file = files.at(n);
    VisitMembers(header, [&](auto& member) { Take(rest, member); });
  }
  return headers;
}

VoxelArray ReadSlicesApart(std::span<const DicomHeader> slices, const std::stop_token& stop) {
  double voxels = 0;
  for (const DicomHeader& slice : slices) {
    voxels += static_cast<double>(slice.rows) * slice.columns;
  }
  constexpr double kBytesPerVoxel = 16;  // of a slice as GDCM has it, the volume, and what is sent
  return ArrayOf(DoApart(
      [&](const TellFile& tell) {
        VoxelArray array;
        for (const DicomHeader& slice : slices) {
          tell(slice.file.string());
          AppendDicomSlice(slice, array);
        }
        return BytesOf(array);
      },
      kWork_bytes + kBytesPerVoxel * voxels, stop));
}

}  // namespace semblance
