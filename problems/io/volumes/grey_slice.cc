// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/grey_slice.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace semblance::problems {
namespace {

// The box around the volume's corners in the picture of the plane.
Eigen::AlignedBox2d ExtentInPicture(const CtVolume& volume, const PicturePlane& plane) {
  Eigen::AlignedBox2d extent;
  for (const int column : {0, volume.columns - 1}) {
    for (const int row : {0, volume.rows - 1}) {
      for (const int slice : {0, volume.slices - 1}) {
        extent.extend(plane.InPicture(volume.World(column, row, slice)));
      }
    }
  }
  return extent;
}

bool IsInside(const CtVolume& volume, const Vec3& voxel) {
  const Vec3 last(volume.columns - 1, volume.rows - 1, volume.slices - 1);
  return (voxel.array() >= -0.5).all() && (voxel.array() <= last.array() + 0.5).all();
}

}  // namespace

double CtBrightness(double hu) {
  constexpr double kAir = -400, kSoft = 200, kDense = 2000, kSoftShare = 0.55;
  return hu < kSoft ? kSoftShare * std::clamp((hu - kAir) / (kSoft - kAir), 0.0, 1.0)
                    : kSoftShare +
                          (1 - kSoftShare) * std::clamp((hu - kSoft) / (kDense - kSoft), 0.0, 1.0);
}

GreySlice SampleSlice(const CtVolume& volume, const PicturePlane& plane, std::string name,
                      double pixel_mm) {
  const Eigen::AlignedBox2d extent = ExtentInPicture(volume, plane);
  const Vec2 pixels = extent.sizes() / pixel_mm;
  GreySlice slice{.name = std::move(name),
                  .low_mm = extent.min(),
                  .pixel_mm = pixel_mm,
                  .width = std::max(1, static_cast<int>(std::ceil(pixels.x()))),
                  .height = std::max(1, static_cast<int>(std::ceil(pixels.y())))};
  for (int y = slice.height - 1; y >= 0; --y) {
    for (int x = 0; x < slice.width; ++x) {
      const Vec3 at = plane.InSpace(slice.low_mm + pixel_mm * Vec2(x + 0.5, y + 0.5));
      const bool inside = IsInside(volume, volume.VoxelAt(at));
      slice.grey.push_back(static_cast<std::uint8_t>(
          inside ? std::lround(255 * CtBrightness(SampleHu(volume, at))) : 0));
    }
  }
  return slice;
}

}  // namespace semblance::problems
