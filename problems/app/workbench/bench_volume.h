// SPDX-License-Identifier: GPL-3.0-or-later
// Slices of a volume with its thresholds, which the page shows before surfaces are extracted.
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "problems/io/volumes/read_volume.h"
#include "problems/report/pictures/image.h"

namespace semblance::problems {

// Keeps the volume that was read last, because a person looks at many slices of one volume. Safe to
// use from several threads.
class BenchVolume {
 public:
  std::shared_ptr<const VolumeReading> Read(const std::filesystem::path& path,
                                            const ReadVolumeOptions& options,
                                            const RunContext& context);
  // Frees the volume.
  void Drop();

 private:
  std::mutex mutex_;
  std::string key_;
  std::shared_ptr<const VolumeReading> reading_;
};

enum class SlicePlane { kAxial, kSagittal, kCoronal };
constexpr auto EnumNames(SlicePlane) {
  return std::to_array<std::string_view>({"axial", "sagittal", "coronal"});
}

struct SliceOptions {
  SlicePlane plane = SlicePlane::kAxial;
  double at = 0.5;        // place of the slice, 0: lowest, rightmost, frontmost; 1: the other end
  double bone_hu = kNaN;  // this value and above is tinted as bone; NaN: no threshold
  double skin_hu = kNaN;  // the border of this value is drawn as skin; NaN: none
  double longest_side = 320;  // pixels
};

// The slice in the usual directions: the subject's right on the left of the picture, the front on
// the top of an axial slice and on the left of a sagittal one, the crown on top of the others. Its
// pixels are square in mm, each the value of the nearest voxel. Throws InputError for options out
// of range.
Image DrawSlice(const CtVolume& volume, const SliceOptions& options);

}  // namespace semblance::problems
