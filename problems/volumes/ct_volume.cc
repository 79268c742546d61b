// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/volumes/ct_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "surfaces/base/error.h"

namespace semblance {

void CheckVolumeClaim(const VolumeClaim& claim, const std::string& where) {
  constexpr double kMostPacked = 5000;  // bytes out of one; gzip's most is 1032
  const auto& [x, y, z] = claim.counts;
  const std::string voxels = fmt::format("{:.10g} x {:.10g} x {:.10g} voxels", x, y, z);
  if (!(std::min({x, y, z}) >= 1)) {
    throw InputError(fmt::format("{}: {} are not a volume", where, voxels));
  }
  const double count = x * y * z;
  if (!(count * sizeof(std::int16_t) <= kLargestVolume_bytes)) {
    throw InputError(fmt::format(
        "{}: {} are {:.3g} GB; at most {:.3g} GB are read: crop the volume or resample it", where,
        voxels, count * sizeof(std::int16_t) / 1e9, kLargestVolume_bytes / 1e9));
  }
  if (count * claim.bytes_per_voxel > kMostPacked * claim.file_bytes) {
    throw IoError(fmt::format("{}: a file of {} bytes cannot hold {}; copy or export it again",
                              where, claim.file_bytes, voxels));
  }
}

void CheckVolume(const CtVolume& volume, const std::string& where) {
  if (std::min({volume.columns, volume.rows, volume.slices}) < 2) {
    throw InputError(fmt::format("{}: {} x {} x {} voxels are not a volume; it needs 2 each way",
                                 where, volume.columns, volume.rows, volume.slices));
  }
  const Vec3& s = volume.spacing_mm;
  if (!s.allFinite() || s.minCoeff() < kLeastSpacing_mm || s.maxCoeff() > kMostSpacing_mm) {
    throw InputError(
        fmt::format("{}: a spacing of {} x {} x {} mm is not usable; each must be {} to {} mm: "
                    "correct it in the header if its unit is another",
                    where, s.x(), s.y(), s.z(), kLeastSpacing_mm, kMostSpacing_mm));
  }
  constexpr double kFlattest = 0.1;  // volume of the cell of unit steps; 1 if they are square
  if (!volume.origin.allFinite() || !(volume.axes.determinant() > kFlattest)) {
    throw InputError(fmt::format(
        "{}: its origin or axes are not usable; the axes must be three different directions",
        where));
  }
  const std::size_t expected = volume.Index(0, 0, volume.slices);
  if (volume.values.size() != expected) {
    throw InputError(
        fmt::format("{}: {} values do not fill {} voxels", where, volume.values.size(), expected));
  }
}

double SampleHu(const CtVolume& volume, const Vec3& world) {
  const std::array<int, 3> counts = {volume.columns, volume.rows, volume.slices};
  const Vec3 at_voxel = volume.VoxelAt(world);
  std::array<int, 3> low;
  std::array<double, 3> t;
  for (int a = 0; a < 3; ++a) {
    const double inside = std::clamp(at_voxel[a], 0.0, counts[a] - 1.0);
    low[a] = std::min(static_cast<int>(inside), counts[a] - 2);
    t[a] = inside - low[a];
  }
  const std::int16_t* v = volume.values.data() + volume.Index(low[0], low[1], low[2]);
  const std::size_t row = volume.columns, slice = row * volume.rows;
  const auto along_row = [&](std::size_t at) { return v[at] + t[0] * (v[at + 1] - v[at]); };
  const double front = along_row(0) + t[1] * (along_row(row) - along_row(0));
  const double back = along_row(slice) + t[1] * (along_row(slice + row) - along_row(slice));
  return front + t[2] * (back - front);
}

}  // namespace semblance
