// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/volumes/ct_volume.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/testing/scratch_file.h"

namespace semblance {
namespace {

using ::testing::HasSubstr;
using testing::WordsOf;

// 5 x 6 x 7 voxels, turned and skew.
CtVolume SkewVolume() {
  CtVolume volume;
  volume.columns = 5;
  volume.rows = 6;
  volume.slices = 7;
  volume.spacing_mm = Vec3(1, 2, 3);
  volume.origin = Vec3(-20, 40, 100);
  volume.axes.col(0) = Vec3(1, 0.2, 0).normalized();
  volume.axes.col(1) = Vec3(-0.2, 1, 0.1).normalized();
  volume.axes.col(2) = Vec3(0, -0.4, 1).normalized();
  volume.values.assign(5 * 6 * 7, 0);
  return volume;
}

TEST(CtVolume, VoxelsAreFoundWhereTheyLie) {
  const CtVolume volume = SkewVolume();
  EXPECT_EQ(volume.World(0, 0, 0), volume.origin);
  for (const Vec3& at : {Vec3(0, 0, 0), Vec3(4, 5, 6), Vec3(1.25, 3.5, -2.75)}) {
    EXPECT_LT((volume.VoxelAt(volume.World(at.x(), at.y(), at.z())) - at).norm(), 1e-12);
  }
}

TEST(CtVolume, SamplingIsExactOnVoxelsAndLinearBetween) {
  CtVolume volume = SkewVolume();
  const auto linear = [](const Vec3& v) { return 10 * v.x() - 4 * v.y() + 7 * v.z() + 30; };
  for (int k = 0; k < 7; ++k) {
    for (int j = 0; j < 6; ++j) {
      for (int i = 0; i < 5; ++i) {
        volume.values[volume.Index(i, j, k)] = static_cast<std::int16_t>(linear(Vec3(i, j, k)));
      }
    }
  }
  for (const Vec3& at :
       {Vec3(0, 0, 0), Vec3(4, 5, 6), Vec3(1.25, 3.5, 2.75), Vec3(3.9, 0.1, 5.5)}) {
    EXPECT_NEAR(SampleHu(volume, volume.World(at.x(), at.y(), at.z())), linear(at), 1e-9);
  }
  EXPECT_NEAR(SampleHu(volume, volume.World(-9, -9, -9)), linear({0, 0, 0}), 1e-9);
}

TEST(CtVolume, WhatIsNoVolumeIsToldSo) {
  const auto words = [](const auto& spoil) {
    CtVolume volume = SkewVolume();
    spoil(volume);
    return WordsOf<InputError>([&] { CheckVolume(volume, "x"); });
  };
  EXPECT_THAT(words([](CtVolume& v) { v.slices = 1; }), HasSubstr("needs 2 each way"));
  for (const double spacing : {0.0, -1.0, 0.005, 20.5, kNaN, 1e300}) {
    EXPECT_THAT(words([&](CtVolume& v) { v.spacing_mm.y() = spacing; }),
                HasSubstr("each must be 0.01 to 20 mm"));
  }
  EXPECT_THAT(words([](CtVolume& v) { v.axes.col(1) = v.axes.col(0); }),
              HasSubstr("three different directions"));
  EXPECT_THAT(words([](CtVolume& v) { v.values.pop_back(); }), HasSubstr("do not fill"));
}

TEST(CtVolume, AClaimIsJudgedBeforeMemoryIsTaken) {
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

}  // namespace
}  // namespace semblance
