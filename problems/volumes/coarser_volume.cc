// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/volumes/coarser_volume.h"

#include <algorithm>
#include <cmath>

#include "surfaces/base/parallel.h"

namespace semblance {
namespace {

// What one new voxel covers of the old ones along an axis.
struct Cover {
  int first = 0;
  std::vector<double> share;  // of the new voxel, of `first` and those after it; their sum is 1
};

double Wanted(double spacing_mm, double least_mm) { return std::max(spacing_mm, least_mm); }

Vec3 WantedSpacing(const CtVolume& volume, const CoarserVoxels& voxels) {
  const Vec3& s = volume.spacing_mm;
  return {Wanted(s.x(), voxels.pixel_mm), Wanted(s.y(), voxels.pixel_mm),
          Wanted(s.z(), voxels.slice_mm)};
}

// `ratio`: old voxels in a new one, 1 or more.
std::vector<Cover> CoversAlong(int count, double ratio) {
  constexpr double kRounding = 1e-9;
  std::vector<Cover> covers(static_cast<std::size_t>(count / ratio + kRounding));
  for (std::size_t k = 0; k < covers.size(); ++k) {
    const double from = static_cast<double>(k) * ratio, to = from + ratio;
    covers[k].first = static_cast<int>(from);
    for (int i = covers[k].first; i < count && i < to; ++i) {
      covers[k].share.push_back((std::min(to, i + 1.0) - std::max<double>(from, i)) / ratio);
    }
  }
  return covers;
}

double MeanOf(const CtVolume& volume, const Cover& columns, const Cover& rows,
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
  return WantedSpacing(volume, voxels) != volume.spacing_mm;
}

CtVolume CoarserVolume(const CtVolume& volume, const CoarserVoxels& voxels, int threads) {
  const Vec3 spacing_mm = WantedSpacing(volume, voxels);
  const Vec3 ratio = spacing_mm.cwiseQuotient(volume.spacing_mm);
  const std::vector<Cover> columns = CoversAlong(volume.columns, ratio.x()),
                           rows = CoversAlong(volume.rows, ratio.y()),
                           slices = CoversAlong(volume.slices, ratio.z());
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
            static_cast<std::int16_t>(std::lround(MeanOf(volume, column, row, slices[slice])));
      }
    }
  });
  CheckVolume(coarser, "a coarser volume");
  return coarser;
}

}  // namespace semblance
