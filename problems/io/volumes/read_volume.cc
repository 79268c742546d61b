// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/read_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "problems/io/volumes/child_process.h"
#include "problems/io/volumes/ct_volume.h"
#include "problems/io/volumes/dicom_series.h"
#include "problems/io/volumes/invesalius.h"
#include "problems/io/volumes/itk_files.h"
#include "problems/io/volumes/volume_headers.h"
#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"
#include "surfaces/base/lower_case.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// ---------------------------------------------------------------------------------------------
// ITK and GDCM in a child process. Parent and child are one program, so the bytes of values serve
// as the format of its messages.
// ---------------------------------------------------------------------------------------------

template <class Value>
void Put(std::string& bytes, const Value& value) {
  static_assert(std::is_trivially_copyable_v<Value>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class Value>
void Get(std::string_view& bytes, Value& value) {
  std::memcpy(&value, bytes.data(), sizeof value);
  bytes.remove_prefix(sizeof value);
}

void Put(std::string& bytes, const std::string& text) {
  Put(bytes, text.size());
  bytes += text;
}

void Get(std::string_view& bytes, std::string& text) {
  std::size_t size = 0;
  Get(bytes, size);
  text = bytes.substr(0, size);
  bytes.remove_prefix(size);
}

void Put(std::string& bytes, const std::vector<std::string>& texts) {
  Put(bytes, texts.size());
  for (const std::string& text : texts) {
    Put(bytes, text);
  }
}

void Get(std::string_view& bytes, std::vector<std::string>& texts) {
  std::size_t count = 0;
  Get(bytes, count);
  texts.resize(count);
  for (std::string& text : texts) {
    Get(bytes, text);
  }
}

template <int rows, int columns>
void Put(std::string& bytes, const Eigen::Matrix<double, rows, columns>& matrix) {
  bytes.append(reinterpret_cast<const char*>(matrix.data()), sizeof(double) * rows * columns);
}

template <int rows, int columns>
void Get(std::string_view& bytes, Eigen::Matrix<double, rows, columns>& matrix) {
  std::memcpy(matrix.data(), bytes.data(), sizeof(double) * rows * columns);
  bytes.remove_prefix(sizeof(double) * rows * columns);
}

template <class Value>
void Put(std::string& bytes, const std::optional<Value>& value) {
  Put(bytes, value.has_value());
  Put(bytes, value.value_or(Value(Value::Zero())));
}

template <class Value>
void Get(std::string_view& bytes, std::optional<Value>& value) {
  bool has_value = false;
  Value stored = Value::Zero();
  Get(bytes, has_value);
  Get(bytes, stored);
  value = has_value ? std::optional(stored) : std::nullopt;
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

std::string EncodeArray(const VoxelArray& array) {
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

VoxelArray DecodeArray(std::string_view bytes) {
  VoxelArray array;
  Get(bytes, array.counts);
  Get(bytes, array.origin);
  Get(bytes, array.steps);
  Get(bytes, array.clipped);
  Get(bytes, array.not_finite);
  Get(bytes, array.notes);
  array.values.resize(bytes.size() / sizeof array.values[0]);
  std::memcpy(array.values.data(), bytes.data(), bytes.size());
  return array;
}

// Memory for the work of the libraries, in addition to that of the voxels.
constexpr double kWork_bytes = 512e6;

// Enough memory for all voxels that the file can hold at the largest compression ratio of gzip,
// three times: as read, as voxels, and as sent.
double MemoryFor_bytes(const fs::path& file) {
  constexpr double kMaxCompressionRatio = 1032, kCopies = 3;
  std::error_code fault;
  const auto size = static_cast<double>(fs::file_size(file, fault));
  const bool is_whole = !fault && !HasDetachedVoxels(file);
  return kWork_bytes + kCopies * (is_whole ? std::min(kMaxCompressionRatio * size, kMaxVolume_bytes)
                                           : kMaxVolume_bytes);
}

// Like ReadImageVolume.
VoxelArray ReadImageInChild(const fs::path& file, VolumeFormat format,
                            const std::stop_token& stop) {
  return DecodeArray(RunInChildProcess(
      [&](const ReportFile& report) {
        report(file.string());
        return EncodeArray(ReadImageVolume(file, format));
      },
      MemoryFor_bytes(file), stop));
}

// Like ScanDicom.
std::vector<DicomHeader> ScanDicomInChild(const std::vector<fs::path>& files,
                                          const std::stop_token& stop) {
  const std::string bytes = RunInChildProcess(
      [&](const ReportFile& report) {
        std::string headers;
        for (std::size_t n = 0; n < files.size(); ++n) {
          report(files[n].string());
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
    Get(rest, n);
    DicomHeader& header = headers.emplace_back();
    header.file = files.at(n);
    VisitMembers(header, [&](auto& member) { Get(rest, member); });
  }
  return headers;
}

// Reads slices of equal size; their voxels follow each other in the array.
VoxelArray ReadSlicesInChild(std::span<const DicomHeader> slices, const std::stop_token& stop) {
  double voxels = 0;
  for (const DicomHeader& slice : slices) {
    voxels += static_cast<double>(slice.rows) * slice.columns;
  }
  constexpr double kBytesPerVoxel = 16;  // slice in GDCM, volume, and bytes to send, together
  return DecodeArray(RunInChildProcess(
      [&](const ReportFile& report) {
        VoxelArray array;
        for (const DicomHeader& slice : slices) {
          report(slice.file.string());
          AppendDicomSlice(slice, array);
        }
        return EncodeArray(array);
      },
      kWork_bytes + kBytesPerVoxel * voxels, stop));
}

// ---------------------------------------------------------------------------------------------
// Values and notes
// ---------------------------------------------------------------------------------------------

struct Ending {
  std::string_view ending;
  VolumeFormat format;
};
constexpr std::array kEndings = {
    Ending{".nii", VolumeFormat::kNifti},     Ending{".nii.gz", VolumeFormat::kNifti},
    Ending{".nrrd", VolumeFormat::kNrrd},     Ending{".nhdr", VolumeFormat::kNrrd},
    Ending{".mha", VolumeFormat::kMetaImage}, Ending{".mhd", VolumeFormat::kMetaImage},
};

std::string LowerCaseName(const fs::path& path) { return LowerCase(path.filename().string()); }

// Notes values that do not fit int16. Throws if the values cannot be grey values of a scanner.
void CheckValues(const VoxelArray& array, const std::string& where,
                 std::vector<std::string>& notes) {
  constexpr int kMinGreyLevels = 100;  // masks and labels have fewer
  const auto [low, high] = std::ranges::minmax(array.values);
  if (high - low < kMinGreyLevels) {
    throw InputError(fmt::format(
        "{}: its values run from {} to {} only; Hounsfield units are needed (air -1000, bone at "
        "least 300), or the grey values of an MR in at least {} steps",
        where, low, high, kMinGreyLevels));
  }
  if (array.clipped > 0) {
    notes.push_back(
        fmt::format("{} values beyond 16 bits were set to {} or {}", array.clipped, -32768, 32767));
  }
  if (array.not_finite > 0) {
    notes.push_back(fmt::format("{} values are not numbers and count as air", array.not_finite));
  }
}

void NoteGeometry(const CtVolume& volume, std::vector<std::string>& notes) {
  notes.push_back(fmt::format("{} x {} x {} voxels of {:.4g} x {:.4g} x {:.4g} mm", volume.columns,
                              volume.rows, volume.slices, volume.spacing_mm.x(),
                              volume.spacing_mm.y(), volume.spacing_mm.z()));
}

VolumeReading Finish(VoxelArray array, VolumeReading reading, const std::string& where) {
  std::vector<std::string> notes = array.notes;
  CheckValues(array, where, notes);
  reading.volume = ToCtVolume(std::move(array), where);
  NoteGeometry(reading.volume, reading.notes);
  reading.notes.insert(reading.notes.end(), notes.begin(), notes.end());
  return reading;
}

// Interpolates a missing slice between the nearest slices below and above that are present.
void InterpolateSlice(const SliceStack& stack, std::size_t slice, VoxelArray& array) {
  const auto present = [&](std::size_t k) { return stack.slices[k] >= 0; };
  std::size_t below = slice, above = slice;
  while (!present(below)) {
    --below;
  }
  while (!present(above)) {
    ++above;
  }
  const std::size_t size = static_cast<std::size_t>(array.counts[0]) * array.counts[1];
  const double t = static_cast<double>(slice - below) / static_cast<double>(above - below);
  for (std::size_t n = 0; n < size; ++n) {
    const double low = array.values[below * size + n], high = array.values[above * size + n];
    array.values[slice * size + n] = static_cast<std::int16_t>(std::lround(low + t * (high - low)));
  }
}

// The slices of the stack that are present, in its order.
std::vector<DicomHeader> PresentSlices(const DicomSeries& series, const SliceStack& stack) {
  std::vector<DicomHeader> present;
  for (const int slice : stack.slices) {
    if (slice >= 0) {
      present.push_back(series.slices[slice]);
    }
  }
  return present;
}

// Reads all slices of the stack in its order, and interpolates missing ones.
void ReadSlices(const DicomSeries& series, const SliceStack& stack, const std::string& where,
                const RunContext& context, VoxelArray& array) {
  const std::size_t size = static_cast<std::size_t>(array.counts[0]) * array.counts[1];
  CheckVolumeClaim(
      {.counts = {static_cast<double>(array.counts[0]), static_cast<double>(array.counts[1]),
                  static_cast<double>(stack.slices.size())}},
      where);
  const VoxelArray read = ReadSlicesInChild(PresentSlices(series, stack), context.stop_token);
  array.clipped = read.clipped;
  array.not_finite = read.not_finite;
  array.values.resize(size * stack.slices.size());
  auto from = read.values.begin();
  for (std::size_t k = 0; k < stack.slices.size(); ++k) {
    if (stack.slices[k] >= 0) {
      std::copy_n(from, size, array.values.begin() + static_cast<std::ptrdiff_t>(k * size));
      from += static_cast<std::ptrdiff_t>(size);
    }
  }
  for (std::size_t k = 0; k < stack.slices.size(); ++k) {
    if (stack.slices[k] < 0) {
      InterpolateSlice(stack, k, array);
    }
  }
}

SliceStack MakeStack(const DicomSeries& series, const Vec3& normal,
                     const ReadVolumeOptions& options, const std::string& where) {
  std::vector<Vec3> positions;
  std::vector<std::string> names;
  for (const DicomHeader& slice : series.slices) {
    positions.push_back(*slice.position);
    names.push_back(slice.file.filename().string());
  }
  return StackSlices(positions, normal, names, {.fill = options.fill_slices},
                     fmt::format("{}: series {}", where, series.name));
}

void NoteTilt(const SliceStack& stack, const Vec3& normal, std::vector<std::string>& notes) {
  constexpr double kMinNotedTilt_deg = 0.5;  // rounded positions alone can look like less
  const double tilt_deg = TiltDeg(stack, normal);
  if (tilt_deg > kMinNotedTilt_deg) {
    notes.push_back(fmt::format(
        "the gantry was tilted by {:.1f} deg: the slices are not resampled, their places in space "
        "are exact",
        tilt_deg));
  }
}

VolumeReading ReadSeries(const DicomSeries& series, const ReadVolumeOptions& options,
                         const RunContext& context, VolumeReading reading,
                         const std::string& where) {
  const DicomHeader& first = series.First();
  const Vec3 normal = first.along_columns->cross(*first.along_rows).normalized();
  const SliceStack stack = MakeStack(series, normal, options, where);
  reading.notes.push_back(fmt::format("series {}", DescribeSeries(series)));
  reading.notes.insert(reading.notes.end(), stack.notes.begin(), stack.notes.end());
  NoteTilt(stack, normal, reading.notes);
  VoxelArray array;
  array.counts = {first.columns, first.rows, static_cast<int>(stack.slices.size())};
  array.origin = stack.origin;
  array.steps << first.spacing_mm->x() * *first.along_columns,
      first.spacing_mm->y() * *first.along_rows, stack.step;
  ReadSlices(series, stack, where, context, array);
  reading.modality = first.modality == "MR"   ? Modality::kMr
                     : first.modality == "CT" ? Modality::kCt
                                              : Modality::kUnknown;
  return Finish(std::move(array), std::move(reading), where);
}

VolumeReading ReadDicomFolder(const fs::path& folder, const ReadVolumeOptions& options,
                              const RunContext& context) {
  const std::string where = folder.string();
  const std::vector<fs::path> files = VolumeFiles(folder);
  const std::vector<DicomHeader> headers = ScanDicomInChild(files, context.stop_token);
  if (headers.empty()) {
    throw IoError(
        fmt::format("{}: none of the {} files in the folder is DICOM", where, files.size()));
  }
  VolumeReading reading;
  const std::vector<DicomSeries> all = GroupSeries(headers, reading.notes);
  if (all.empty()) {
    throw InputError(fmt::format("{}: no file of {} is a slice with a place in space{}{}", where,
                                 headers.size(), reading.notes.empty() ? "" : ": ",
                                 fmt::join(reading.notes, "; ")));
  }
  const DicomSeries& series = ChooseSeries(all, options.series, where, reading.notes);
  return ReadSeries(series, options, context, std::move(reading), where);
}

VolumeReading ReadFile(const fs::path& path, const RunContext& context) {
  const std::string where = path.string();
  if (LowerCaseName(path).ends_with(".inv3")) {
    VolumeReading reading{.volume = ReadInvesalius(path), .modality = Modality::kCt, .notes = {}};
    NoteGeometry(reading.volume, reading.notes);
    return reading;
  }
  const std::optional<VolumeFormat> format = FindVolumeFormat(path);
  if (!format) {
    throw InputError(fmt::format(
        "{}: not a kind of volume that is read; allowed are a folder of DICOM files (for a "
        "single slice name its folder), .nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd and .inv3",
        where));
  }
  return Finish(ReadImageInChild(path, *format, context.stop_token), {}, where);
}

}  // namespace

std::optional<VolumeFormat> FindVolumeFormat(const fs::path& path) {
  const std::string name = LowerCaseName(path);
  for (const Ending& ending : kEndings) {
    if (name.ends_with(ending.ending)) {
      return ending.format;
    }
  }
  return std::nullopt;
}

std::vector<fs::path> VolumeFiles(const fs::path& path) {
  if (!fs::is_directory(path)) {
    return {path};
  }
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path)) {
    if (entry.is_regular_file()) {
      files.push_back(entry.path());
    }
  }
  std::ranges::sort(files);
  return files;
}

VolumeReading ReadVolume(const fs::path& path, const ReadVolumeOptions& options,
                         const RunContext& context) {
  if (!fs::exists(path)) {
    throw IoError(fmt::format("{}: no such file or folder", path.string()));
  }
  if (fs::is_directory(path)) {
    return ReadDicomFolder(path, options, context);
  }
  if (!options.series.empty() || options.fill_slices) {
    throw InputError(
        fmt::format("{}: series and fill_slices are for folders of DICOM files, and this is a file",
                    path.string()));
  }
  return ReadFile(path, context);
}

}  // namespace semblance::problems
