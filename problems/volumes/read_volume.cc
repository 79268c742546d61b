// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/volumes/read_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "problems/volumes/dicom_series.h"
#include "problems/volumes/invesalius.h"
#include "problems/volumes/itk_files.h"
#include "problems/volumes/slice_stack.h"
#include "problems/volumes/voxel_array.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

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

// Notes on values that int16 does not hold; throws if they cannot be grey values of a scanner.
void CheckValues(const VoxelArray& array, const std::string& where,
                 std::vector<std::string>& notes) {
  constexpr int kFewestSteps = 100;
  const auto [low, high] = std::ranges::minmax(array.values);
  if (high - low < kFewestSteps) {
    throw InputError(fmt::format(
        "{}: its values run from {} to {} only; Hounsfield units are needed (air -1000, bone 300 "
        "and more), or the grey values of an MR in {} steps and more",
        where, low, high, kFewestSteps));
  }
  if (array.clipped > 0) {
    notes.push_back(
        fmt::format("{} values beyond 16 bit were set to {} or {}", array.clipped, -32768, 32767));
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

// Voxel by voxel between the slices below and above, which are there.
void Interpolate(const SliceStack& stack, std::size_t slice, VoxelArray& array) {
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

// The slices of the stack that are there, in its order.
std::vector<DicomHeader> PresentSlices(const DicomSeries& series, const SliceStack& stack) {
  std::vector<DicomHeader> present;
  for (const int slice : stack.slices) {
    if (slice >= 0) {
      present.push_back(series.slices[slice]);
    }
  }
  return present;
}

// All slices of the stack, in its order; what is missing is interpolated.
void ReadSlices(const DicomSeries& series, const SliceStack& stack, const std::string& where,
                const RunContext& context, VoxelArray& array) {
  const std::size_t size = static_cast<std::size_t>(array.counts[0]) * array.counts[1];
  CheckVolumeClaim(
      {.counts = {static_cast<double>(array.counts[0]), static_cast<double>(array.counts[1]),
                  static_cast<double>(stack.slices.size())}},
      where);
  const VoxelArray read = ReadSlicesApart(PresentSlices(series, stack), context.stop_token);
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
      Interpolate(stack, k, array);
    }
  }
}

SliceStack StackOf(const DicomSeries& series, const Vec3& normal, const ReadVolumeOptions& options,
                   const std::string& where) {
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
  constexpr double kLeastTilt_deg = 0.5;
  const double tilt_deg = TiltDeg(stack, normal);
  if (tilt_deg > kLeastTilt_deg) {
    notes.push_back(fmt::format(
        "the gantry was tilted by {:.1f} deg: the slices stay as they are, their places in space "
        "are exact",
        tilt_deg));
  }
}

VolumeReading ReadSeries(const DicomSeries& series, const ReadVolumeOptions& options,
                         const RunContext& context, VolumeReading reading,
                         const std::string& where) {
  const DicomHeader& first = series.First();
  const Vec3 normal = first.along_columns->cross(*first.along_rows).normalized();
  const SliceStack stack = StackOf(series, normal, options, where);
  reading.notes.push_back(fmt::format("series {}", InWords(series)));
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
  const std::vector<DicomHeader> headers = ScanDicomApart(files, context.stop_token);
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
  const std::optional<VolumeFormat> format = VolumeFormatOf(path);
  if (!format) {
    throw InputError(fmt::format(
        "{}: not a kind of volume that is read; it may be a folder of DICOM files (of a single "
        "slice name its folder), .nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd or .inv3",
        where));
  }
  return Finish(ReadImageApart(path, *format, context.stop_token), {}, where);
}

}  // namespace

std::optional<VolumeFormat> VolumeFormatOf(const fs::path& path) {
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

}  // namespace semblance
