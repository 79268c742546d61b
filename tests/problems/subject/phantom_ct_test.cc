// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/phantom_ct.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/testing/scratch_file.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;

// Air is -1000, tissue 40: the sum over a head without bone tells its volume.
TEST(PhantomCt, HasTheVolumeOfTheMesh) {
  Phantom phantom = MakePhantom({.rings = 20});
  const double expected_mm3 = SignedVolume(phantom.face);
  const CtVolume volume =
      VoxelisePhantom(phantom, {.pixel_mm = 4, .slice_mm = 5, .bone_mm = 0, .head_holder = false});
  double sum = 0;
  for (const std::int16_t value : volume.values) {
    sum += (value + 1000.0) / 1040;
  }
  EXPECT_NEAR(sum * volume.spacing_mm.prod() / expected_mm3, 1, 1e-3);
}

TEST(PhantomCt, ValuesAreThoseOfTheTissueThere) {
  const Phantom phantom = MakePhantom({.rings = 30});
  const CtVolume volume = VoxelisePhantom(phantom, {.pixel_mm = 2, .slice_mm = 3, .threads = 2});
  for (const PhantomSite& site : phantom.sites) {
    EXPECT_GT(SampleHu(volume, site.base - 3 * site.normal), 600) << site.site;
    EXPECT_NEAR(SampleHu(volume, site.base + (site.depth_mm + 6) * site.normal), -1000, 1);
  }
  EXPECT_EQ(SampleHu(volume, phantom.centre), 40);                               // brain
  EXPECT_GT(std::count(volume.values.begin(), volume.values.end(), 100), 1000);  // holder
}

TEST(PhantomCt, ThreadsChangeNothing) {
  const Phantom phantom = MakePhantom({.rings = 12});
  EXPECT_EQ(VoxelisePhantom(phantom, {.pixel_mm = 6, .slice_mm = 6, .threads = 1}).values,
            VoxelisePhantom(phantom, {.pixel_mm = 6, .slice_mm = 6, .threads = 3}).values);
}

TEST(PhantomCt, BoneIsLostInABallAndNowhereElse) {
  const Phantom phantom = MakePhantom({.rings = 30});
  const BoneDefect defect = {.site = "zy_r", .radius_mm = 20};
  const CtVolume whole = VoxelisePhantom(phantom, {.pixel_mm = 3, .slice_mm = 3}),
                 volume =
                     VoxelisePhantom(phantom, {.pixel_mm = 3, .slice_mm = 3, .defect = defect});
  const LostBone ball(phantom.sites, defect);
  int lost = 0;
  for (int k = 0; k < volume.slices; ++k) {
    for (int j = 0; j < volume.rows; ++j) {
      for (int i = 0; i < volume.columns; ++i) {
        const auto before = whole.values[whole.Index(i, j, k)],
                   now = volume.values[volume.Index(i, j, k)];
        const bool is_lost = ball.Holds(volume.World(i, j, k));
        EXPECT_TRUE(is_lost ? now <= 40 : now == before);
        lost += is_lost && before > 600 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(lost, 50);
}

TEST(PhantomCt, RefusesADefectAtAnUnknownSite) {
  EXPECT_THAT(testing::WordsOf<InputError>(
                  [] { VoxelisePhantom(MakePhantom({.rings = 8}), {.defect = {.site = "zy"}}); }),
              HasSubstr("no site 'zy'"));
}

TEST(PhantomCt, SpacingsAreChecked) {
  EXPECT_THAT(testing::WordsOf<InputError>(
                  [] { VoxelisePhantom(MakePhantom({.rings = 8}), {.pixel_mm = 0}); }),
              HasSubstr("each must be > 0"));
}

}  // namespace
}  // namespace semblance::problems
