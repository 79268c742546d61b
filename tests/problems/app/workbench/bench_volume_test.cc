// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_volume.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Air with bone in one voxel: the one at the right, at the front, in the lowest slice.
CtVolume OneBone() {
  CtVolume volume;
  volume.columns = volume.rows = volume.slices = 4;
  volume.spacing_mm = {1, 1, 2};
  volume.values.assign(64, -1000);
  volume.values[volume.Index(0, 0, 0)] = 1000;
  return volume;
}

// The share of the pixels, in a part of the picture, that are tinted as bone.
double BoneShare(const Image& image, double left, double top, double right, double bottom) {
  int bone = 0, all = 0;
  for (int y = static_cast<int>(top * image.height); y < static_cast<int>(bottom * image.height);
       ++y) {
    for (int x = static_cast<int>(left * image.width); x < static_cast<int>(right * image.width);
         ++x, ++all) {
      const std::uint8_t* rgb = &image.rgb[3 * (x + static_cast<std::size_t>(image.width) * y)];
      bone += rgb[0] > rgb[2] + 20 ? 1 : 0;
    }
  }
  return static_cast<double>(bone) / all;
}

TEST(DrawSlice, HasTheSubjectsRightOnTheLeftAndTheCrownOnTop) {
  const CtVolume volume = OneBone();
  const Image axial = DrawSlice(volume, {.at = 0, .bone_hu = 300});
  EXPECT_EQ(axial.width, axial.height);
  EXPECT_EQ(BoneShare(axial, 0, 0, 0.25, 0.25), 1) << "right and front";
  EXPECT_NEAR(BoneShare(axial, 0, 0, 1, 1), 1.0 / 16, 1e-12);
  for (const SlicePlane plane : {SlicePlane::kSagittal, SlicePlane::kCoronal}) {
    const Image upright = DrawSlice(volume, {.plane = plane, .at = 0, .bone_hu = 300});
    EXPECT_EQ(upright.height, 2 * upright.width) << "slices are 2 mm apart";
    EXPECT_EQ(BoneShare(upright, 0, 0.75, 0.25, 1), 1) << "the lowest slice is at the bottom";
    EXPECT_EQ(BoneShare(DrawSlice(volume, {.plane = plane, .at = 1, .bone_hu = 300}), 0, 0, 1, 1),
              0);
  }
}

TEST(DrawSlice, WithoutAThresholdNothingIsTinted) {
  EXPECT_EQ(BoneShare(DrawSlice(OneBone(), {.at = 0}), 0, 0, 1, 1), 0);
  EXPECT_EQ(BoneShare(DrawSlice(OneBone(), {.at = 0, .bone_hu = 1001}), 0, 0, 1, 1), 0);
}

TEST(DrawSlice, RefusesPlacesAndSizesOutOfRange) {
  for (const SliceOptions& options :
       {SliceOptions{.at = -0.1}, {.at = kNaN}, {.longest_side = 2000}, {.longest_side = kNaN}}) {
    EXPECT_THROW(DrawSlice(OneBone(), options), InputError);
  }
}

}  // namespace
}  // namespace semblance::problems
