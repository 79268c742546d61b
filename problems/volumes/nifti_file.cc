// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/volumes/nifti_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"

namespace semblance {
namespace {

constexpr std::size_t kHeader_bytes = 348;

struct NiftiHeader {
  int datatype = -1;                     // NIfTI's code of the voxels' type, as they are stored
  double voxels_at = kNaN;               // byte at which they begin
  int qform_code = -1, sform_code = -1;  // above 0: there is a quaternion, a matrix
  std::array<float, 3> steps{};          // from voxel to voxel along each axis
  std::array<float, 6> quaternion{};     // with its place
  std::array<float, 12> matrix{};        // rows
};

// Less where the file ends before.
std::string HeaderBytesOf(const std::filesystem::path& file) {
  std::string bytes;
  if (IsGzip(file)) {
    Unpack(file, [&](std::string_view block) {
      bytes += block.substr(0, kHeader_bytes - bytes.size());
      return bytes.size() < kHeader_bytes;
    });
    return bytes;
  }
  bytes.resize(kHeader_bytes);
  std::ifstream in(file, std::ios::binary);
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

// A value of the header, whose bytes may stand the other way round.
template <class Value>
Value ValueAt(const std::string& header, std::size_t at, bool swapped) {
  std::array<char, sizeof(Value)> bytes{};
  std::memcpy(bytes.data(), header.data() + at, bytes.size());
  if (swapped) {
    std::ranges::reverse(bytes);
  }
  return std::bit_cast<Value>(bytes);
}

template <std::size_t count>
void TakeFloats(const std::string& header, std::size_t at, bool swapped,
                std::array<float, count>& values) {
  for (std::size_t k = 0; k < count; ++k) {
    values[k] = ValueAt<float>(header, at + sizeof(float) * k, swapped);
  }
}

// As stored; 0 for other types than those of one real number.
double BytesPerVoxel(int datatype) {
  switch (datatype) {
    case 2:    // uint8
    case 256:  // int8
      return 1;
    case 4:    // int16
    case 512:  // uint16
      return 2;
    case 8:    // int32
    case 768:  // uint32
    case 16:   // float32
      return 4;
    case 1024:  // int64
    case 1280:  // uint64
    case 64:    // float64
      return 8;
    default:
      return 0;
  }
}

// Nothing if the file is shorter.
std::optional<NiftiHeader> ReadHeader(const std::filesystem::path& file) {
  const std::string bytes = HeaderBytesOf(file);
  if (bytes.size() < kHeader_bytes) {
    return std::nullopt;
  }
  const bool swapped = ValueAt<std::int32_t>(bytes, 0, /*swapped=*/true) == kHeader_bytes;
  NiftiHeader header;
  header.datatype = ValueAt<std::int16_t>(bytes, 70, swapped);
  // What is no number leaves the header's end.
  header.voxels_at = std::max<double>(kHeader_bytes, ValueAt<float>(bytes, 108, swapped));
  header.qform_code = ValueAt<std::int16_t>(bytes, 252, swapped);
  header.sform_code = ValueAt<std::int16_t>(bytes, 254, swapped);
  TakeFloats(bytes, 80, swapped, header.steps);
  TakeFloats(bytes, 256, swapped, header.quaternion);
  TakeFloats(bytes, 280, swapped, header.matrix);
  return header;
}

// The bytes within the file; where there are more than `enough`, so many at least.
double UnpackedSize(const std::filesystem::path& file, double enough) {
  if (!IsGzip(file)) {
    return static_cast<double>(std::filesystem::file_size(file));
  }
  double count = 0;
  Unpack(file, [&](std::string_view block) {
    count += static_cast<double>(block.size());
    return count <= enough;
  });
  return count;
}

}  // namespace

void CheckNiftiPlaces(const std::filesystem::path& file) {
  constexpr double kFarthest_mm = 1e9;
  const std::optional<NiftiHeader> header = ReadHeader(file);
  if (!header) {
    return;
  }
  const auto check = [&](std::span<const float> values) {
    for (const double value : values) {
      if (!(std::abs(value) <= kFarthest_mm)) {
        throw InputError(
            fmt::format("{}: one of the numbers that say how its voxels lie is {}; export it again",
                        file.string(), value));
      }
    }
  };
  check(header->steps);
  if (header->qform_code > 0) {
    check(header->quaternion);
  }
  if (header->sform_code > 0) {
    check(header->matrix);
  }
}

bool NiftiSaysHowItLies(const std::filesystem::path& file) {
  const std::optional<NiftiHeader> header = ReadHeader(file);
  return header && (header->qform_code > 0 || header->sform_code > 0);
}

void CheckNiftiWhole(const std::filesystem::path& file, double voxels) {
  constexpr double kEndOfMember_bytes = 1 << 20;  // with so many more its end has been seen
  const std::optional<NiftiHeader> header = ReadHeader(file);
  if (!header) {
    return;
  }
  const double needed = voxels * BytesPerVoxel(header->datatype);
  const double whole = header->voxels_at + needed;
  if (UnpackedSize(file, whole + kEndOfMember_bytes) < whole) {
    throw IoError(
        fmt::format("{}: the file is cut short: {:.0f} bytes of voxels are needed; copy or export "
                    "it again",
                    file.string(), needed));
  }
}

}  // namespace semblance
