// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/volumes/coarser_volume.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/ct/import_ct.h"
#include "tests/testing/ct_phantom.h"
#include "tests/testing/scratch_file.h"

namespace semblance {
namespace {

using ::testing::Contains;
using testing::CtPhantom;
using ::testing::HasSubstr;
using testing::WordsOf;

// 10 x 12 x 14 voxels of 1 x 1 x 1.5 mm, turned and skew.
CtVolume VolumeOf(double (*hu)(const Vec3& voxel)) {
  CtVolume volume;
  volume.columns = 10;
  volume.rows = 12;
  volume.slices = 14;
  volume.spacing_mm = Vec3(1, 1, 1.5);
  volume.origin = Vec3(-20, 40, 100);
  volume.axes.col(0) = Vec3(1, 0.2, 0).normalized();
  volume.axes.col(1) = Vec3(-0.2, 1, 0.1).normalized();
  volume.axes.col(2) = Vec3(0, -0.4, 1).normalized();
  for (int k = 0; k < volume.slices; ++k) {
    for (int j = 0; j < volume.rows; ++j) {
      for (int i = 0; i < volume.columns; ++i) {
        volume.values.push_back(static_cast<std::int16_t>(hu(Vec3(i, j, k))));
      }
    }
  }
  return volume;
}

// The mean of what is linear is what it is in the middle, wherever the new voxels cut the old.
TEST(CoarserVolume, WhatIsLinearStaysAtItsPlace) {
  const CtVolume fine =
      VolumeOf([](const Vec3& v) { return 100 * v.x() - 40 * v.y() + 70 * v.z(); });
  for (const CoarserVoxels& voxels :
       {CoarserVoxels{2, 3}, CoarserVoxels{2.5, 2}, CoarserVoxels{1.7, 0}, CoarserVoxels{0, 4}}) {
    const CtVolume coarser = CoarserVolume(fine, voxels, 1);
    CheckVolume(coarser, "it");
    for (int k = 0; k < coarser.slices; ++k) {
      for (int j = 0; j < coarser.rows; ++j) {
        for (int i = 0; i < coarser.columns; ++i) {
          // A cut voxel is one value all over: a part of its step may be missed, but no more.
          EXPECT_NEAR(coarser.values[coarser.Index(i, j, k)],
                      SampleHu(fine, coarser.World(i, j, k)), 0.13 * (100 + 40 + 70) + 0.5);
        }
      }
    }
  }
}

TEST(CoarserVolume, WholeVoxelsAreMeansOfTheirOwn) {
  const CtVolume fine =
      VolumeOf([](const Vec3& v) { return 100 * v.x() - 40 * v.y() + 70 * v.z(); });
  const CtVolume coarser = CoarserVolume(fine, {.pixel_mm = 2, .slice_mm = 3}, 1);
  EXPECT_EQ(coarser.columns, 5);
  EXPECT_EQ(coarser.rows, 6);
  EXPECT_EQ(coarser.slices, 7);
  EXPECT_EQ(coarser.spacing_mm, Vec3(2, 2, 3));
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(coarser.values[coarser.Index(i, 1, 2)], 100 * (2 * i + 0.5) - 40 * 2.5 + 70 * 4.5);
    EXPECT_LT((coarser.World(i, 1, 2) - fine.World(2 * i + 0.5, 2.5, 4.5)).norm(), 1e-12);
  }
}

TEST(CoarserVolume, OnlyFinerAxesChangeAndThreadsChangeNothing) {
  const CtVolume fine = VolumeOf([](const Vec3& v) { return 13 * v.x() * v.y() - 7 * v.z(); });
  EXPECT_FALSE(IsFinerThan(fine, {}));
  EXPECT_FALSE(IsFinerThan(fine, {.pixel_mm = 1, .slice_mm = 1.2}));
  EXPECT_TRUE(IsFinerThan(fine, {.pixel_mm = 1, .slice_mm = 1.6}));
  EXPECT_EQ(CoarserVolume(fine, {.pixel_mm = 0.5, .slice_mm = 1}, 1).values, fine.values);
  const CtVolume one = CoarserVolume(fine, {.pixel_mm = 0.5, .slice_mm = 2}, 1);
  EXPECT_EQ(one.columns, fine.columns);
  EXPECT_EQ(one.slices, 10);  // of 21 mm; the last mm is less than a slice
  EXPECT_EQ(CoarserVolume(fine, {.pixel_mm = 0.5, .slice_mm = 2}, 3).values, one.values);
}

TEST(CoarserVolume, WhatIsNoVolumeAnyMoreIsToldSo) {
  const CtVolume fine = VolumeOf([](const Vec3&) { return 0.0; });
  EXPECT_THAT(WordsOf<InputError>([&] { CoarserVolume(fine, {.pixel_mm = 8}, 1); }),
              HasSubstr("1 x 1 x 14 voxels are not a volume"));
}

// An edge stays where the mean of a voxel is midway: the balls keep their size within a part of
// the coarser voxels, and the notes say what was done.
TEST(CoarserVolume, AnImportSaysThatItWasMadeCoarser) {
  const CtPhantom head;
  const CtImport import =
      ImportCt(head.Make(), {.skin_hu = -480, .coarsen = {.pixel_mm = 3, .slice_mm = 3}}, {});
  EXPECT_THAT(import.notes, Contains(HasSubstr("3 x 3 x 3 mm instead of 1.5 x 1.5 x 1.5 mm")));
  int off = 0;
  for (const Vec3& p : import.skin.points) {
    off += std::abs((p - head.centre).norm() - head.skin_mm) > 1 ? 1 : 0;
  }
  EXPECT_LT(off, static_cast<int>(import.skin.points.size() / 20));  // the plug of the nostril
}

}  // namespace
}  // namespace semblance
