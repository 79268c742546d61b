// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_volume.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "problems/io/volumes/grey_slice.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Voxel axes along the picture's rows and columns, and across it; down: the picture's columns run
// against their voxel axis.
struct PlaneAxes {
  int across, right, down;
  bool reversed;
};
constexpr std::array kPlanes = {PlaneAxes{2, 0, 1, false}, PlaneAxes{0, 1, 2, true},
                                PlaneAxes{1, 0, 2, true}};

int VoxelsAlong(const CtVolume& volume, int axis) {
  return std::array{volume.columns, volume.rows, volume.slices}[axis];
}

int VoxelOf(double share, int count) {
  return std::clamp(static_cast<int>(share * count), 0, count - 1);
}

// The slice's value at shares of the picture's width and height.
class SliceReader {
 public:
  SliceReader(const CtVolume& volume, const SliceOptions& options)
      : volume_(volume), axes_(kPlanes[static_cast<std::size_t>(options.plane)]) {
    at_[axes_.across] = VoxelOf(options.at, VoxelsAlong(volume, axes_.across));
  }

  const PlaneAxes& Axes() const { return axes_; }

  int Value(double right, double down) {
    at_[axes_.right] = VoxelOf(right, VoxelsAlong(volume_, axes_.right));
    at_[axes_.down] = VoxelOf(axes_.reversed ? 1 - down : down, VoxelsAlong(volume_, axes_.down));
    return volume_.values[volume_.Index(at_[0], at_[1], at_[2])];
  }

 private:
  const CtVolume& volume_;
  PlaneAxes axes_;
  std::array<int, 3> at_ = {0, 0, 0};
};

void CheckSliceOptions(const SliceOptions& options) {
  constexpr int kMaxSide = 1024;
  if (!(options.at >= 0 && options.at <= 1) ||
      !(options.longest_side >= 16 && options.longest_side <= kMaxSide)) {
    throw InputError("slice: its place is from 0 to 1, its longest side from 16 to 1024 pixels");
  }
}

}  // namespace

std::shared_ptr<const VolumeReading> BenchVolume::Read(const std::filesystem::path& path,
                                                       const ReadVolumeOptions& options,
                                                       const RunContext& context) {
  const std::lock_guard lock(mutex_);
  std::string key = path.string() + "\n" + options.series + (options.fill_slices ? "\nfilled" : "");
  if (key != key_) {
    reading_ = nullptr;  // before the next one takes memory
    key_.clear();
    reading_ = std::make_shared<const VolumeReading>(ReadVolume(path, options, context));
    key_ = std::move(key);
  }
  return reading_;
}

void BenchVolume::Drop() {
  const std::lock_guard lock(mutex_);
  key_.clear();
  reading_ = nullptr;
}

Image DrawSlice(const CtVolume& volume, const SliceOptions& options) {
  constexpr Colour kBone{1, 0.62, 0.2}, kSkin{0.3, 0.75, 1};
  constexpr double kTint = 0.55;
  CheckSliceOptions(options);
  SliceReader reader(volume, options);
  const auto length_mm = [&](int axis) {
    return VoxelsAlong(volume, axis) * volume.spacing_mm[axis];
  };
  const double wide_mm = length_mm(reader.Axes().right), high_mm = length_mm(reader.Axes().down);
  const double scale = options.longest_side / std::max(wide_mm, high_mm);
  Image image = MakeImage(std::max(1, static_cast<int>(wide_mm * scale)),
                          std::max(1, static_cast<int>(high_mm * scale)), {});
  const auto value = [&](int x, int y) {
    return reader.Value((x + 0.5) / image.width, (y + 0.5) / image.height);
  };
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const int hu = value(x, y);
      const double grey = CtBrightness(hu);
      BlendPixel(image, x, y, {grey, grey, grey}, 1);
      if (hu >= options.bone_hu) {
        BlendPixel(image, x, y, kBone, kTint);
      }
      const bool is_tissue = hu >= options.skin_hu;
      if ((x > 0 && is_tissue != (value(x - 1, y) >= options.skin_hu)) ||
          (y > 0 && is_tissue != (value(x, y - 1) >= options.skin_hu))) {
        BlendPixel(image, x, y, kSkin, kTint);
      }
    }
  }
  return image;
}

}  // namespace semblance::problems
