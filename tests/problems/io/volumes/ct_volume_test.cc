// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/ct_volume.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using testing::WordsOf;

// 10 x 12 x 14 voxels of 1 x 1 x 1.5 mm, turned and skew.
CtVolume MakeVolume(double (*hu)(const Vec3& voxel)) {
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

TEST(CtVolume, VoxelAtInvertsWorld) {
  const CtVolume volume = MakeVolume([](const Vec3&) { return 0.0; });
  EXPECT_EQ(volume.World(0, 0, 0), volume.origin);
  for (const Vec3& at : {Vec3(0, 0, 0), Vec3(4, 5, 6), Vec3(1.25, 3.5, -2.75)}) {
    EXPECT_LT((volume.VoxelAt(volume.World(at.x(), at.y(), at.z())) - at).norm(), 1e-12);
  }
}

TEST(CtVolume, SamplingIsTrilinear) {
  const auto linear = [](const Vec3& v) { return 10 * v.x() - 4 * v.y() + 7 * v.z() + 30; };
  const CtVolume volume = MakeVolume(linear);
  for (const Vec3& at :
       {Vec3(0, 0, 0), Vec3(4, 5, 6), Vec3(1.25, 3.5, 2.75), Vec3(3.9, 0.1, 5.5)}) {
    EXPECT_NEAR(SampleHu(volume, volume.World(at.x(), at.y(), at.z())), linear(at), 1e-9);
  }
  EXPECT_NEAR(SampleHu(volume, volume.World(-9, -9, -9)), linear({0, 0, 0}), 1e-9);
}

TEST(CtVolume, AnUnusableVolumeIsAClearError) {
  const auto words = [](const auto& spoil) {
    CtVolume volume = MakeVolume([](const Vec3&) { return 0.0; });
    spoil(volume);
    return WordsOf<InputError>([&] { CheckVolume(volume, "x"); });
  };
  EXPECT_THAT(words([](CtVolume& v) { v.slices = 1; }),
              HasSubstr("needs at least 2 along each axis"));
  for (const double spacing : {0.0, -1.0, 0.005, 20.5, kNaN, 1e300}) {
    EXPECT_THAT(words([&](CtVolume& v) { v.spacing_mm.y() = spacing; }),
                HasSubstr("each must be 0.01 to 20 mm"));
  }
  EXPECT_THAT(words([](CtVolume& v) { v.axes.col(1) = v.axes.col(0); }),
              HasSubstr("three different directions"));
  EXPECT_THAT(words([](CtVolume& v) { v.values.pop_back(); }), HasSubstr("do not fill"));
}

TEST(CtVolume, AnImpossibleClaimIsRefused) {
  const auto words = [](const VolumeClaim& claim) {
    return WordsOf<Error>([&] { CheckVolumeClaim(claim, "x"); });
  };
  EXPECT_NO_THROW(CheckVolumeClaim({.counts = {512, 512, 600}, .file_bytes = 1e6}, "x"));
  EXPECT_NO_THROW(CheckVolumeClaim({.counts = {2000, 2000, 1000}}, "x"));
  EXPECT_THAT(words({.counts = {2000, 2000, 1001}}), HasSubstr("at most 8 GB are read"));
  EXPECT_THAT(words({.counts = {1e9, 1e9, 1e9}}),
              HasSubstr("1000000000 x 1000000000 x 1000000000 voxels"));
  EXPECT_THAT(words({.counts = {1e300, 1e300, 1e300}}), HasSubstr("at most 8 GB"));
  EXPECT_THAT(words({.counts = {kNaN, 2, 2}}), HasSubstr("not a volume"));
  EXPECT_THAT(words({.counts = {0, 512, 512}}), HasSubstr("not a volume"));
  EXPECT_THAT(words({.counts = {512, 512, 100}, .file_bytes = 1000}), HasSubstr("cannot hold"));
}

// The mean of a linear field over a voxel is its value at the centre of the voxel.
TEST(CoarserVolume, ALinearFieldKeepsItsValues) {
  const CtVolume fine =
      MakeVolume([](const Vec3& v) { return 100 * v.x() - 40 * v.y() + 70 * v.z(); });
  for (const CoarserVoxels& voxels :
       {CoarserVoxels{2, 3}, CoarserVoxels{2.5, 2}, CoarserVoxels{1.7, 0}, CoarserVoxels{0, 4}}) {
    const CtVolume coarser = MakeCoarserVolume(fine, voxels, 1);
    CheckVolume(coarser, "it");
    for (int k = 0; k < coarser.slices; ++k) {
      for (int j = 0; j < coarser.rows; ++j) {
        for (int i = 0; i < coarser.columns; ++i) {
          // A cut voxel is constant, so the mean misses at most a part of the step across it.
          EXPECT_NEAR(coarser.values[coarser.Index(i, j, k)],
                      SampleHu(fine, coarser.World(i, j, k)), 0.13 * (100 + 40 + 70) + 0.5);
        }
      }
    }
  }
}

TEST(CoarserVolume, WholeVoxelsAreMeansOfTheVoxelsTheyCover) {
  const CtVolume fine =
      MakeVolume([](const Vec3& v) { return 100 * v.x() - 40 * v.y() + 70 * v.z(); });
  const CtVolume coarser = MakeCoarserVolume(fine, {.pixel_mm = 2, .slice_mm = 3}, 1);
  EXPECT_EQ(coarser.columns, 5);
  EXPECT_EQ(coarser.rows, 6);
  EXPECT_EQ(coarser.slices, 7);
  EXPECT_EQ(coarser.spacing_mm, Vec3(2, 2, 3));
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(coarser.values[coarser.Index(i, 1, 2)], 100 * (2 * i + 0.5) - 40 * 2.5 + 70 * 4.5);
    EXPECT_LT((coarser.World(i, 1, 2) - fine.World(2 * i + 0.5, 2.5, 4.5)).norm(), 1e-12);
  }
}

TEST(CoarserVolume, OnlyFinerAxesChangeAndThreadsDoNotMatter) {
  const CtVolume fine = MakeVolume([](const Vec3& v) { return 13 * v.x() * v.y() - 7 * v.z(); });
  EXPECT_FALSE(IsFinerThan(fine, {}));
  EXPECT_FALSE(IsFinerThan(fine, {.pixel_mm = 1, .slice_mm = 1.2}));
  EXPECT_TRUE(IsFinerThan(fine, {.pixel_mm = 1, .slice_mm = 1.6}));
  EXPECT_EQ(MakeCoarserVolume(fine, {.pixel_mm = 0.5, .slice_mm = 1}, 1).values, fine.values);
  const CtVolume one = MakeCoarserVolume(fine, {.pixel_mm = 0.5, .slice_mm = 2}, 1);
  EXPECT_EQ(one.columns, fine.columns);
  EXPECT_EQ(one.slices, 10);  // in 21 mm; the last mm is less than a slice
  EXPECT_EQ(MakeCoarserVolume(fine, {.pixel_mm = 0.5, .slice_mm = 2}, 3).values, one.values);
}

TEST(CoarserVolume, TooFewVoxelsAreAClearError) {
  const CtVolume fine = MakeVolume([](const Vec3&) { return 0.0; });
  EXPECT_THAT(WordsOf<InputError>([&] { MakeCoarserVolume(fine, {.pixel_mm = 8}, 1); }),
              HasSubstr("1 x 1 x 14 voxels are not a volume"));
}

}  // namespace
}  // namespace semblance::problems
