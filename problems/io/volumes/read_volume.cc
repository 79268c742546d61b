// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/read_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <sstream>
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
#include "problems/io/volumes/nifti_file.h"
#include "problems/io/volumes/volume_headers.h"
#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/mesh_files/text_lines.h"

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

// Calls `visit` with each member but the file.
template <class Header, class Visit>
void VisitMembers(Header& header, const Visit& visit) {
  for (auto* text :
       {&header.characters, &header.series_uid, &header.series_number, &header.description,
        &header.modality, &header.image_type, &header.patient_id, &header.patient_name,
        &header.birth_date, &header.space_uid, &header.lacking, &header.fault, &header.comma}) {
    visit(*text);
  }
  for (auto* number :
       {&header.frame, &header.rows, &header.columns, &header.frames, &header.instance}) {
    visit(*number);
  }
  for (auto* number : {&header.slope, &header.intercept, &header.thickness_mm, &header.tilt_deg}) {
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

// The files of the volume. The library looks for the voxels of a detached header by rules of its
// own, so it may look into its folder.
std::vector<fs::path> ReadableFor(const fs::path& file) {
  std::vector<fs::path> readable = VolumeFiles(file);
  if (HasDetachedVoxels(file)) {
    readable.push_back(fs::absolute(file).parent_path());
  }
  return readable;
}

// Like ReadNifti or ReadImageVolume.
VoxelArray ReadImageInChild(const fs::path& file, VolumeFormat format,
                            const std::stop_token& stop) {
  return DecodeArray(RunInChildProcess(
      [&](const ReportFile& report) {
        report(file.string());
        return EncodeArray(format == VolumeFormat::kNifti ? ReadNifti(file)
                                                          : ReadImageVolume(file, format));
      },
      {.memory_bytes = MemoryFor_bytes(file), .readable = ReadableFor(file)}, stop));
}

// The texts that are shown or compared, as UTF-8 without control characters. Here and not in the
// child, because the tables of the character sets are files that the system loads.
void CleanTexts(DicomHeader& header) {
  for (std::string* text :
       {&header.description, &header.patient_id, &header.patient_name, &header.birth_date}) {
    *text = DicomTextToUtf8(*text, header.characters);
  }
  for (std::string* text :
       {&header.series_uid, &header.series_number, &header.modality, &header.image_type}) {
    *text = CleanDicomText(*text);
  }
}

// Like ScanDicom, for many files.
std::vector<DicomHeader> ScanDicomInChild(const std::vector<fs::path>& files,
                                          const std::stop_token& stop) {
  const std::string bytes = RunInChildProcess(
      [&](const ReportFile& report) {
        std::string headers;
        for (std::size_t n = 0; n < files.size(); ++n) {
          report(files[n].string());
          for (const DicomHeader& header : ScanDicom(files[n])) {
            Put(headers, n);
            VisitMembers(header, [&](const auto& member) { Put(headers, member); });
          }
        }
        return headers;
      },
      {.memory_bytes = kWork_bytes, .readable = files}, stop);
  std::vector<DicomHeader> headers;
  for (std::string_view rest = bytes; !rest.empty();) {
    std::size_t n = 0;
    Get(rest, n);
    DicomHeader& header = headers.emplace_back();
    header.file = files.at(n);
    VisitMembers(header, [&](auto& member) { Get(rest, member); });
    CleanTexts(header);
  }
  return headers;
}

// Reads slices of equal size; their voxels follow each other in the array.
VoxelArray ReadSlicesInChild(std::span<const DicomHeader> slices, const std::stop_token& stop) {
  double voxels = 0;
  std::vector<fs::path> files;
  for (const DicomHeader& slice : slices) {
    voxels += static_cast<double>(slice.rows) * slice.columns;
    files.push_back(slice.file);
  }
  constexpr double kBytesPerVoxel = 16;  // slice in GDCM, volume, and bytes to send, together
  return DecodeArray(RunInChildProcess(
      [&](const ReportFile& report) { return EncodeArray(ReadDicomSlices(slices, report)); },
      {.memory_bytes = kWork_bytes + kBytesPerVoxel * voxels, .readable = files}, stop));
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
    Ending{".hdr", VolumeFormat::kNifti},     Ending{".nrrd", VolumeFormat::kNrrd},
    Ending{".nhdr", VolumeFormat::kNrrd},     Ending{".mha", VolumeFormat::kMetaImage},
    Ending{".mhd", VolumeFormat::kMetaImage},
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

// Notes axes that are not at right angles, which a tilted gantry makes. Throws InputError for more
// than a gantry can be tilted.
void CheckSkewness(const CtVolume& volume, const std::string& where,
                   std::vector<std::string>& notes) {
  constexpr double kMinNoted_deg = 0.5;  // rounded positions alone can look like less
  constexpr double kMaxTilt_deg = 40;    // scanners allow 30
  const Mat3 cosines = volume.axes.transpose() * volume.axes;
  const double largest =
      std::max({std::abs(cosines(0, 1)), std::abs(cosines(0, 2)), std::abs(cosines(1, 2))});
  const double skew_deg = std::asin(std::min(largest, 1.0)) * 180 / std::numbers::pi;
  if (skew_deg > kMaxTilt_deg) {
    throw InputError(fmt::format(
        "{}: its axes are {:.1f} deg off right angles, and a tilted gantry makes at most {}; "
        "correct its header, or export it again",
        where, skew_deg, kMaxTilt_deg));
  }
  if (skew_deg > kMinNoted_deg) {
    notes.push_back(fmt::format(
        "the gantry was tilted by {:.1f} deg, or the volume is skew for another reason: the slices "
        "are not resampled, their places in space are exact",
        skew_deg));
  }
}

// Values that are not numbers get the lowest value that is one, which is that of air.
void FillWithAir(VoxelArray& array) {
  constexpr std::int16_t kNoNumber = std::numeric_limits<std::int16_t>::min();
  std::int16_t lowest = std::numeric_limits<std::int16_t>::max();
  for (const std::int16_t value : array.values) {
    lowest = value == kNoNumber ? lowest : std::min(lowest, value);
  }
  std::ranges::replace(array.values, kNoNumber, lowest);
}

// The differences of a slice from the one below it: their median, and the range of the middle half.
struct SliceStep {
  int median = 0, spread = 0;
};

SliceStep CompareWithSliceBelow(const VoxelArray& array, std::size_t slice) {
  constexpr std::size_t kEnough = 4096;  // voxels; more would cost time in proportion
  const std::size_t size = static_cast<std::size_t>(array.counts[0]) * array.counts[1];
  std::vector<int> differences;
  for (std::size_t n = 0; n < size; n += size / kEnough + 1) {
    differences.push_back(array.values[slice * size + n] - array.values[(slice - 1) * size + n]);
  }
  const auto at = [&](std::size_t quarter) {
    const auto place =
        differences.begin() + static_cast<std::ptrdiff_t>(quarter * (differences.size() - 1) / 4);
    std::ranges::nth_element(differences, place);
    return *place;
  };
  return {.median = at(2), .spread = at(3) - at(1)};
}

// Notes slices between which most voxels, air and tissue alike, change by about the same amount: a
// part of the slices has another offset. Anatomy changes some voxels much and most of them little.
// Volumes without values of air in Hounsfield units are not checked.
void NoteLevelSteps(const VoxelArray& array, std::vector<std::string>& notes) {
  constexpr int kLeast = 60;  // HU; drifts of a scanner from slice to slice are below 10
  constexpr int kAir = -500;
  std::string found;
  const int slices = std::ranges::min(array.values) <= kAir ? array.counts[2] : 0;
  for (int k = 1; k < slices; ++k) {
    const SliceStep step = CompareWithSliceBelow(array, static_cast<std::size_t>(k));
    if (std::abs(step.median) >= kLeast && step.spread < std::abs(step.median)) {
      found += fmt::format("{}slices {} and {} ({:+d})", found.empty() ? "" : ", ", k, k + 1,
                           step.median);
    }
  }
  if (!found.empty()) {
    notes.push_back(
        fmt::format("most values change by one amount between {}: a part of the slices has another "
                    "offset, and bone and skin are then at wrong places; export the volume again",
                    found));
  }
}

VolumeReading Finish(VoxelArray array, VolumeReading reading, const std::string& where) {
  if (array.not_finite > 0) {
    FillWithAir(array);
  }
  std::vector<std::string> notes = array.notes;
  CheckValues(array, where, notes);
  NoteLevelSteps(array, notes);
  reading.volume = ToCtVolume(std::move(array), where);
  NoteGeometry(reading.volume, reading.notes);
  CheckSkewness(reading.volume, where, reading.notes);
  reading.notes.insert(reading.notes.end(), notes.begin(), notes.end());
  return reading;
}

// The slices of the stack: scanned ones, and ones interpolated between two scanned ones.
std::vector<std::int16_t> MakeSlices(const SliceStack& stack, std::vector<std::int16_t> scanned) {
  const auto is_scanned = [](double place) { return place == std::floor(place); };
  if (std::ranges::all_of(stack.places, is_scanned)) {
    return scanned;
  }
  const std::size_t size = scanned.size() / stack.scanned.size();
  std::vector<std::int16_t> values;
  values.reserve(size * stack.places.size());
  for (const double place : stack.places) {
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, stack.scanned.size() - 1);
    const double t = place - static_cast<double>(below);
    for (std::size_t n = 0; n < size; ++n) {
      const double low = scanned[below * size + n], high = scanned[above * size + n];
      values.push_back(static_cast<std::int16_t>(std::lround(low + t * (high - low))));
    }
  }
  return values;
}

// The median of the differences between a slice and another one.
int MedianDifference(std::span<const std::int16_t> slice, std::span<const std::int16_t> other) {
  std::vector<int> differences(slice.size());
  std::ranges::transform(slice, other, differences.begin(), std::minus<int>());
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::ranges::nth_element(differences, middle);
  return *middle;
}

// Throws InputError if most voxels of a slice differ from those of both neighbours by about the
// same amount: its values have another offset, such as a rescale intercept that is lost. names: of
// the slices. Volumes without values of air in Hounsfield units are not checked.
void CheckOffsets(std::span<const std::int16_t> values, std::span<const std::string> names,
                  const std::string& where) {
  constexpr int kOffset =
      300;  // beyond the difference of air, fat and soft tissue to the next slice
  constexpr int kAir = -500;
  if (names.size() < 3 || *std::ranges::min_element(values) > kAir) {
    return;
  }
  const std::size_t size = values.size() / names.size();
  std::vector<int> steps;  // from each slice to the next
  for (std::size_t k = 0; k + 1 < names.size(); ++k) {
    steps.push_back(
        MedianDifference(values.subspan((k + 1) * size, size), values.subspan(k * size, size)));
  }
  for (std::size_t k = 0; k < names.size(); ++k) {
    const int below = k > 0 ? steps[k - 1] : -steps[k];
    const int above = k + 1 < names.size() ? steps[k] : -steps[k - 1];
    if (std::min(std::abs(below), std::abs(above)) > kOffset && (below > 0) != (above > 0)) {
      throw InputError(fmt::format(
          "{}: the values of {} are about {} {} than those of the slices beside it: its offset "
          "({}) or its values are lost; export the series again",
          where, names[k], std::abs(below), below > 0 ? "higher" : "lower", kInterceptTag));
    }
  }
}

// Notes neighbours with the same values, unless these are all one value, as in the air above a
// head.
void NoteEqualSlices(std::span<const std::int16_t> values, std::span<const std::string> names,
                     std::vector<std::string>& notes) {
  const std::size_t size = values.size() / names.size();
  std::vector<std::string> equal;
  for (std::size_t k = 0; k + 1 < names.size(); ++k) {
    const auto slice = values.subspan(k * size, size), next = values.subspan((k + 1) * size, size);
    if (std::ranges::equal(slice, next) &&
        std::ranges::count(slice, slice[0]) < std::ssize(slice)) {
      equal.push_back(fmt::format("{} and {}", names[k], names[k + 1]));
    }
  }
  constexpr std::size_t kMostShare = 20;  // one pair in twenty
  if (!equal.empty() && equal.size() * kMostShare <= names.size()) {
    notes.push_back(fmt::format(
        "neighbouring slices have the same values: {}{}; one of each pair may be a copy in the "
        "place of a lost slice",
        equal[0], equal.size() > 1 ? fmt::format(" and {} more pairs", equal.size() - 1) : ""));
  }
}

// Reads the scanned slices of the stack in its order, and makes those of the stack.
void ReadSlices(const DicomSeries& series, const SliceStack& stack, const std::string& where,
                const RunContext& context, VoxelArray& array) {
  CheckVolumeClaim(
      {.counts = {static_cast<double>(array.counts[0]), static_cast<double>(array.counts[1]),
                  static_cast<double>(stack.places.size())}},
      where);
  std::vector<DicomHeader> slices;
  std::vector<std::string> names;
  for (const int slice : stack.scanned) {
    slices.push_back(series.slices[slice]);
    names.push_back(slices.back().file.filename().string());
  }
  VoxelArray read = ReadSlicesInChild(slices, context.stop_token);
  CheckOffsets(read.values, names, where);
  NoteEqualSlices(read.values, names, array.notes);
  array.clipped = read.clipped;
  array.not_finite = read.not_finite;
  array.values = MakeSlices(stack, std::move(read.values));
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

VolumeReading ReadSeries(const DicomSeries& series, const ReadVolumeOptions& options,
                         const RunContext& context, VolumeReading reading,
                         const std::string& where) {
  const DicomHeader& first = series.First();
  const Vec3 normal = first.along_columns->cross(*first.along_rows).normalized();
  const SliceStack stack = MakeStack(series, normal, options, where);
  reading.notes.push_back(fmt::format("series {}", DescribeSeries(series)));
  reading.notes.insert(reading.notes.end(), stack.notes.begin(), stack.notes.end());
  NoteSliceTags(series, stack, normal, reading.notes);
  VoxelArray array;
  array.counts = {first.columns, first.rows, static_cast<int>(stack.places.size())};
  array.origin = stack.origin;
  array.steps << first.spacing_mm->x() * *first.along_columns,
      first.spacing_mm->y() * *first.along_rows, stack.step;
  ReadSlices(series, stack, where, context, array);
  reading.modality = first.modality == "MR"   ? Modality::kMr
                     : first.modality == "CT" ? Modality::kCt
                                              : Modality::kUnknown;
  return Finish(std::move(array), std::move(reading), where);
}

bool BeginsWithZeros(const fs::path& file) {
  std::array<char, 132> head{};  // as long as the part of a DICOM file that ends with "DICM"
  std::ifstream(file, std::ios::binary).read(head.data(), head.size());
  return std::ranges::count(head, '\0') == static_cast<std::ptrdiff_t>(head.size());
}

// Throws IoError for files that are named like the slices and are empty, or hold zeros only,
// because copying them failed.
void RequireNoEmptyFiles(const std::vector<fs::path>& files,
                         const std::vector<DicomHeader>& headers, const std::string& where) {
  for (const fs::path& file : files) {
    const bool is_like_slice = std::ranges::any_of(headers, [&](const DicomHeader& header) {
      return header.file.parent_path() == file.parent_path() &&
             header.file.extension() == file.extension();
    });
    if (is_like_slice && BeginsWithZeros(file)) {
      throw IoError(
          fmt::format("{}: the file {} is empty or was copied in part; copy it again, or "
                      "remove it",
                      where, file.filename().string()));
    }
  }
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
  RequireNoEmptyFiles(files, headers, where);
  VolumeReading reading;
  const std::vector<DicomSeries> all = GroupSeries(headers, reading.notes);
  if (all.empty()) {
    const auto faulty = std::ranges::find_if(
        headers, [](const DicomHeader& header) { return !header.fault.empty(); });
    if (faulty != headers.end()) {
      reading.notes.push_back(
          fmt::format("{}: {}", Shown(faulty->file.filename().string()), faulty->fault));
    }
    throw InputError(fmt::format("{}: no file of {} is a slice with a place in space{}{}", where,
                                 headers.size(), reading.notes.empty() ? "" : ": ",
                                 fmt::join(reading.notes, "; ")));
  }
  const DicomSeries& series = ChooseSeries(all, options.series, where, reading.notes);
  CheckSeries(series, headers, fmt::format("{}: series {}", where, series.name), reading.notes);
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
        "single slice name its folder), .nii, .nii.gz, .hdr, .nrrd, .nhdr, .mha, .mhd and .inv3",
        where));
  }
  VoxelArray array = ReadImageInChild(path, *format, context.stop_token);
  std::vector<std::string> names;
  for (int slice = 1; slice <= array.counts[2]; ++slice) {
    names.push_back(fmt::format("slice {}", slice));
  }
  CheckOffsets(array.values, names, where);
  NoteEqualSlices(array.values, names, array.notes);
  return Finish(std::move(array), {}, where);
}

// ---------------------------------------------------------------------------------------------
// Voxels in files of their own
// ---------------------------------------------------------------------------------------------

// A header may name many files, e.g. one per slice. A hostile one names more.
constexpr std::size_t kMaxVoxelFiles = 100'000;

// The names that a pattern such as "slice%03d.raw" gives for the numbers first, first + step ...
// last. Empty if it is no such pattern.
std::vector<std::string> ExpandPattern(const std::string& pattern, long first, long last,
                                       long step) {
  const std::size_t begin = pattern.find('%');
  const std::size_t end = pattern.find_first_not_of("0123456789", begin + 1);
  if (begin == pattern.npos || end == pattern.npos || pattern[end] != 'd' || step == 0) {
    return {};
  }
  const std::string digits = pattern.substr(begin + 1, end - begin - 1);
  const std::size_t width = std::min(20UL, std::strtoul(digits.c_str(), nullptr, 10));
  std::vector<std::string> names;
  for (long n = first; (step > 0 ? n <= last : n >= last) && names.size() < kMaxVoxelFiles;
       n += step) {
    std::string number = std::to_string(n);
    number.insert(0, width - std::min(width, number.size()), digits.starts_with('0') ? '0' : ' ');
    names.push_back(pattern.substr(0, begin) + number + pattern.substr(end + 1));
  }
  return names;
}

// The files that a value such as "h.raw", "LIST" or "slice%03d.raw 1 82 1" of a header names.
// following: the lines behind it, which are the list.
std::vector<std::string> ParseVoxelNames(const std::string& value, std::istream& following) {
  std::istringstream words(value);
  std::string word;
  long first = 0, last = 0, step = 1;
  words >> word;
  if (word.starts_with("LIST")) {
    std::vector<std::string> names;
    for (std::string line; std::getline(following, line) && names.size() < kMaxVoxelFiles;) {
      line.erase(line.find_last_not_of(" \t\r") + 1);
      if (!line.empty()) {
        names.push_back(line);
      }
    }
    return names;
  }
  if (words >> first >> last) {
    words >> step;
    return ExpandPattern(word, first, last, step);
  }
  return LowerCase(word) == "local" ? std::vector<std::string>() : std::vector{value};
}

// The files that the text of a MetaImage's or NRRD's header names.
std::vector<std::string> ReadVoxelNames(const fs::path& path, VolumeFormat format) {
  constexpr std::size_t kMaxHeader_bytes = 1 << 20;
  const bool is_nrrd = format == VolumeFormat::kNrrd;
  std::string head(kMaxHeader_bytes, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  std::istringstream lines(head);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t sign = line.find(is_nrrd ? ':' : '=');
    std::string name = LowerCase(line.substr(0, sign)), value;
    std::erase_if(name, [](char c) { return c == ' ' || c == '\t'; });
    if (sign != line.npos && name == (is_nrrd ? "datafile" : "elementdatafile")) {
      value = line.substr(std::min(line.size(), line.find_first_not_of(" \t", sign + 1)));
      value.erase(value.find_last_not_of(" \t\r") + 1);
      return ParseVoxelNames(value, lines);
    }
    if (line.find_first_not_of("\r") == line.npos && is_nrrd) {
      break;  // the voxels follow
    }
  }
  return {};
}

// The files with the voxels, if the file is only a header. They need not exist.
std::vector<fs::path> FindVoxelFiles(const fs::path& path) {
  const std::optional<VolumeFormat> format = FindVolumeFormat(path);
  std::vector<fs::path> files;
  if (format == VolumeFormat::kMetaImage || format == VolumeFormat::kNrrd) {
    for (const std::string& name : ReadVoxelNames(path, *format)) {
      files.push_back(path.parent_path() / name);
    }
  } else if (format == VolumeFormat::kNifti || LowerCaseName(path).ends_with(".hdr")) {
    // A NIfTI or Analyze header is beside its image.
    for (const char* ending : {".img", ".img.gz"}) {
      const fs::path image = fs::path(path).replace_extension(ending);
      if (fs::exists(image)) {
        files.push_back(image);
      }
    }
  }
  return files;
}

}  // namespace

std::vector<VolumeSeries> ListSeries(const fs::path& path, const RunContext& context) {
  std::vector<VolumeSeries> found;
  if (!fs::is_directory(path)) {
    return found;
  }
  std::vector<std::string> notes;
  for (const DicomSeries& series :
       GroupSeries(ScanDicomInChild(VolumeFiles(path), context.stop_token), notes)) {
    const DicomHeader& first = series.First();
    if (series.slices.size() >= 2) {
      found.push_back({.name = series.name,
                       .description = CleanDicomText(first.description),
                       .modality = CleanDicomText(first.modality),
                       .slices = static_cast<int>(series.slices.size()),
                       .columns = first.columns,
                       .rows = first.rows});
    }
  }
  std::ranges::stable_sort(found, std::ranges::greater(), &VolumeSeries::slices);
  return found;
}

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
  std::error_code ignored;  // a path that cannot be reached is a file that cannot be read
  if (!fs::is_directory(path, ignored)) {
    std::vector<fs::path> files = FindVoxelFiles(path);
    files.insert(files.begin(), path);
    return files;
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
