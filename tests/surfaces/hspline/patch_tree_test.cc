// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/patch_tree.h"

#include <gtest/gtest.h>

#include "surfaces/base/random.h"
#include "tests/testing/splines.h"

namespace semblance::surfaces {
namespace {

constexpr HSplineShape kOpen{.patches_u = 4, .patches_v = 5, .max_level = 3};
constexpr HSplineShape kTube{
    .patches_u = 5, .patches_v = 4, .max_level = 3, .closure = Closure::kPeriodicU};

TEST(PatchRegions, CoverEachLeafOnce) {
  for (const HSplineShape& shape : {kOpen, kTube}) {
    const PatchTree tree(testing::RandomSurface(shape, 1, 4));
    std::set<PatchId> covered;
    std::size_t patches = 0;
    for (const PatchRegion& region : UniformRegions(tree)) {
      for (int k = 0; k < region.columns * region.rows; ++k) {
        covered.insert(
            {region.level, region.i + k % region.columns, region.j + k / region.columns});
        ++patches;
      }
    }
    EXPECT_EQ(covered, std::set<PatchId>(tree.leaves().begin(), tree.leaves().end()));
    EXPECT_EQ(patches, tree.leaves().size());
  }
}

TEST(PatchRegions, TheirNetsGiveThePointsOfTheSurface) {
  for (const HSplineShape& shape : {kOpen, kTube}) {
    const HSplineSurface surface = testing::RandomSurface(shape, 2, 4);
    Random random(3);
    for (const PatchRegion& region : UniformRegions(PatchTree(surface))) {
      const HSplineShape plain{
          .patches_u = region.columns, .patches_v = region.rows, .max_level = 0};
      const Vec2 place(random.Uniform(0, 1), random.Uniform(0, 1));
      const Vec2 uv((region.i + place.x() * region.columns) / shape.PatchesU(region.level),
                    (region.j + place.y() * region.rows) / shape.PatchesV(region.level));
      const Vec3 point = StencilAt(plain, 0, place).Apply(RegionNet(surface, region));
      EXPECT_LT((point - surface.Point(uv)).norm(), 1e-10);
    }
  }
}

TEST(PatchRegions, ASurfaceWithoutDetailIsOne) {
  const std::vector<PatchRegion> regions =
      UniformRegions(PatchTree(testing::SmoothSurface(kTube, 1)));
  EXPECT_EQ(regions, (std::vector<PatchRegion>{{0, 0, 0, 5, 4}}));
}

}  // namespace
}  // namespace semblance::surfaces
