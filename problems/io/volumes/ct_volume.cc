// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/ct_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"

namespace semblance::problems {

void CheckVolumeClaim(const VolumeClaim& claim, const std::string& where) {
  // Above gzip's largest compression ratio, 1032, with a margin for other methods.
  constexpr double kMaxCompressionRatio = 5000;
  const auto& [x, y, z] = claim.counts;
  const std::string voxels = fmt::format("{:.10g} x {:.10g} x {:.10g} voxels", x, y, z);
  if (!(std::min({x, y, z}) >= 1)) {
    throw InputError(fmt::format("{}: {} are not a volume", where, voxels));
  }
  const double count = x * y * z;
  if (!(count * sizeof(std::int16_t) <= kMaxVolume_bytes)) {
    throw InputError(fmt::format(
        "{}: {} are {:.3g} GB; at most {:.3g} GB are read: crop the volume or resample it", where,
        voxels, count * sizeof(std::int16_t) / 1e9, kMaxVolume_bytes / 1e9));
  }
  if (count * claim.bytes_per_voxel > kMaxCompressionRatio * claim.file_bytes) {
    throw IoError(fmt::format("{}: a file of {} bytes cannot hold {}; copy or export it again",
                              where, claim.file_bytes, voxels));
  }
}

void CheckVolume(const CtVolume& volume, const std::string& where) {
  if (std::min({volume.columns, volume.rows, volume.slices}) < 2) {
    throw InputError(
        fmt::format("{}: {} x {} x {} voxels are not a volume; it needs at least 2 along each axis",
                    where, volume.columns, volume.rows, volume.slices));
  }
  const Vec3& s = volume.spacing_mm;
  if (!s.allFinite() || s.minCoeff() < kMinSpacing_mm || s.maxCoeff() > kMaxSpacing_mm) {
    throw InputError(
        fmt::format("{}: a spacing of {} x {} x {} mm is not usable; each must be {} to {} mm: "
                    "correct the header if its unit is not mm",
                    where, s.x(), s.y(), s.z(), kMinSpacing_mm, kMaxSpacing_mm));
  }
  // Volume of the cell of unit steps: 1 for axes at right angles, 0 for axes in one plane.
  constexpr double kMinCellVolume = 0.1;
  if (!volume.origin.allFinite() || !(volume.axes.determinant() > kMinCellVolume)) {
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

// ---------------------------------------------------------------------------------------------
// Voxels in the order of a file
// ---------------------------------------------------------------------------------------------

namespace {

// For each axis of the volume: the axis of the file that it is made from, and whether that axis is
// reversed.
struct AxisOrder {
  std::array<int, 3> from = {0, 1, 2};
  std::array<bool, 3> reversed = {false, false, false};

  bool IsIdentity() const {
    return from == std::array{0, 1, 2} && reversed == std::array{false, false, false};
  }
};

// The order in which the unit steps are nearest to the x, y and z axes.
AxisOrder NearestOrder(const Mat3& units) {
  AxisOrder best;
  constexpr double kRoundOff = 1e-9;  // equal sums keep the first order
  double largest = -1;
  std::array<int, 3> from = {0, 1, 2};
  do {
    double sum = 0;
    for (int a = 0; a < 3; ++a) {
      sum += std::abs(units(a, from[a]));
    }
    if (sum > largest + kRoundOff) {
      largest = sum;
      best.from = from;
    }
  } while (std::next_permutation(from.begin(), from.end()));
  for (int a = 0; a < 3; ++a) {
    best.reversed[a] = units(a, best.from[a]) < 0;
  }
  return best;
}

std::vector<std::int16_t> Reorder(const VoxelArray& array, const AxisOrder& order,
                                  const CtVolume& volume) {
  const std::array<std::ptrdiff_t, 3> stride = {
      1, array.counts[0], static_cast<std::ptrdiff_t>(array.counts[0]) * array.counts[1]};
  std::ptrdiff_t first = 0;
  std::array<std::ptrdiff_t, 3> step;
  for (int a = 0; a < 3; ++a) {
    const int f = order.from[a];
    step[a] = order.reversed[a] ? -stride[f] : stride[f];
    first += order.reversed[a] ? stride[f] * (array.counts[f] - 1) : 0;
  }
  std::vector<std::int16_t> values(array.values.size());
  auto out = values.begin();
  for (int k = 0; k < volume.slices; ++k) {
    for (int j = 0; j < volume.rows; ++j) {
      const std::int16_t* const line = array.values.data() + first + k * step[2] + j * step[1];
      for (int i = 0; i < volume.columns; ++i) {
        *out++ = line[i * step[0]];
      }
    }
  }
  return values;
}

}  // namespace

CtVolume ToCtVolume(VoxelArray array, const std::string& where) {
  const Vec3 spacing = array.steps.colwise().norm();
  if (!array.steps.allFinite() || !(spacing.minCoeff() > 0)) {
    throw InputError(fmt::format("{}: a spacing of {} x {} x {} mm is not usable; each must be > 0",
                                 where, spacing.x(), spacing.y(), spacing.z()));
  }
  const AxisOrder order = NearestOrder(array.steps * spacing.cwiseInverse().asDiagonal());
  CtVolume volume;
  volume.origin = array.origin;
  std::array<int*, 3> counts = {&volume.columns, &volume.rows, &volume.slices};
  for (int a = 0; a < 3; ++a) {
    const int f = order.from[a];
    const Vec3 step = array.steps.col(f);
    *counts[a] = array.counts[f];
    volume.spacing_mm[a] = spacing[f];
    volume.axes.col(a) = (order.reversed[a] ? -1 : 1) * step / spacing[f];
    if (order.reversed[a]) {
      volume.origin += (array.counts[f] - 1) * step;
    }
  }
  const std::size_t voxels = volume.Index(0, 0, volume.slices);
  if (array.values.size() == voxels && !order.IsIdentity()) {
    volume.values = Reorder(array, order, volume);
  } else {
    volume.values = std::move(array.values);
  }
  CheckVolume(volume, where);
  return volume;
}

// ---------------------------------------------------------------------------------------------
// Coarser volumes
// ---------------------------------------------------------------------------------------------

namespace {

// The old voxels that one new voxel covers along an axis.
struct Cover {
  int first = 0;
  std::vector<double> share;  // of `first` and the following voxels; the sum is 1
};

Vec3 CoarserSpacing(const CtVolume& volume, const CoarserVoxels& voxels) {
  return volume.spacing_mm.cwiseMax(Vec3(voxels.pixel_mm, voxels.pixel_mm, voxels.slice_mm));
}

// `ratio`: old voxels per new voxel, at least 1.
std::vector<Cover> FindCovers(int count, double ratio) {
  constexpr double kRoundOff = 1e-9;
  std::vector<Cover> covers(static_cast<std::size_t>(count / ratio + kRoundOff));
  for (std::size_t k = 0; k < covers.size(); ++k) {
    const double from = static_cast<double>(k) * ratio, to = from + ratio;
    covers[k].first = static_cast<int>(from);
    for (int i = covers[k].first; i < count && i < to; ++i) {
      covers[k].share.push_back((std::min(to, i + 1.0) - std::max<double>(from, i)) / ratio);
    }
  }
  return covers;
}

double CoveredMean(const CtVolume& volume, const Cover& columns, const Cover& rows,
                   const Cover& slices) {
  double mean = 0;
  for (std::size_t c = 0; c < slices.share.size(); ++c) {
    for (std::size_t b = 0; b < rows.share.size(); ++b) {
      const std::int16_t* row =
          volume.values.data() + volume.Index(columns.first, rows.first + static_cast<int>(b),
                                              slices.first + static_cast<int>(c));
      double along = 0;
      for (std::size_t a = 0; a < columns.share.size(); ++a) {
        along += columns.share[a] * row[a];
      }
      mean += slices.share[c] * rows.share[b] * along;
    }
  }
  return mean;
}

}  // namespace

bool IsFinerThan(const CtVolume& volume, const CoarserVoxels& voxels) {
  return CoarserSpacing(volume, voxels) != volume.spacing_mm;
}

CtVolume MakeCoarserVolume(const CtVolume& volume, const CoarserVoxels& voxels, int threads) {
  const Vec3 spacing_mm = CoarserSpacing(volume, voxels);
  const Vec3 ratio = spacing_mm.cwiseQuotient(volume.spacing_mm);
  const std::vector<Cover> columns = FindCovers(volume.columns, ratio.x()),
                           rows = FindCovers(volume.rows, ratio.y()),
                           slices = FindCovers(volume.slices, ratio.z());
  CtVolume coarser{.columns = static_cast<int>(columns.size()),
                   .rows = static_cast<int>(rows.size()),
                   .slices = static_cast<int>(slices.size()),
                   .spacing_mm = spacing_mm,
                   .axes = volume.axes,
                   .values = {}};
  const Vec3 first = 0.5 * (ratio - Vec3::Ones());
  coarser.origin = volume.World(first.x(), first.y(), first.z());
  coarser.values.resize(coarser.Index(0, 0, coarser.slices));
  ParallelFor(slices.size(), threads, 1, [&](std::size_t slice) {
    std::int16_t* value = coarser.values.data() + coarser.Index(0, 0, static_cast<int>(slice));
    for (const Cover& row : rows) {
      for (const Cover& column : columns) {
        *value++ =
            static_cast<std::int16_t>(std::lround(CoveredMean(volume, column, row, slices[slice])));
      }
    }
  });
  CheckVolume(coarser, "a coarser volume");
  return coarser;
}

}  // namespace semblance::problems
