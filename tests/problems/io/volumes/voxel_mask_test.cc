// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/voxel_mask.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

const VoxelGrid kGrid{{9, 8, 7}, Vec3(1, 1.5, 0.7)};

VoxelMask RandomMask(std::uint64_t random_seed, double share) {
  Random random(random_seed);
  VoxelMask mask(kGrid.Count());
  for (auto& voxel : mask) {
    voxel = random.Uniform(0, 1) < share;
  }
  return mask;
}

Vec3 Centre(std::int64_t n) {
  return Vec3(static_cast<double>(n % 9), static_cast<double>(n / 9 % 8),
              static_cast<double>(n / 72))
      .cwiseProduct(kGrid.spacing_mm);
}

// The component of each voxel; -1 outside of the mask.
std::vector<int> ComponentOfVoxels(const VoxelComponents& pieces) {
  std::vector<int> of_voxel(kGrid.Count(), -1);
  for (const VoxelRun& run : pieces.runs) {
    std::fill_n(of_voxel.begin() + run.first, run.length, run.component);
  }
  return of_voxel;
}

bool ShareAFace(std::int64_t a, std::int64_t b) {
  const Vec3 d = (Centre(a) - Centre(b)).cwiseAbs().cwiseQuotient(kGrid.spacing_mm);
  return std::lround(d.sum()) == 1;
}

TEST(VoxelMask, DilationMatchesBruteForceDistances) {
  const VoxelMask mask = RandomMask(1, 0.02);
  for (const double reach : {0.0, 0.9, 2.1, 4.0}) {
    const VoxelMask grown = Dilate(mask, kGrid, reach, 2);
    for (std::int64_t n = 0; n < kGrid.Count(); ++n) {
      bool near = false;
      for (std::int64_t m = 0; m < kGrid.Count(); ++m) {
        near = near || (mask[m] && (Centre(n) - Centre(m)).norm() <= reach + 1e-9);
      }
      EXPECT_EQ(grown[n] != 0, near) << n << " " << reach;
    }
  }
}

// A mask of more than 4 MB has its memory in large pages.
TEST(VoxelMask, AVoxelInALargeMaskGrowsToABall) {
  const VoxelGrid grid{.counts = {220, 210, 200}, .spacing_mm = Vec3(1, 1, 1)};
  VoxelMask mask(static_cast<std::size_t>(grid.Count()), 0);
  mask[grid.Index(120, 90, 110)] = 1;
  const VoxelMask copy = mask;
  VoxelMask grown = Dilate(mask, grid, 3, 2);
  EXPECT_EQ(std::count(grown.begin(), grown.end(), 1), 123);  // integer points of that ball
  grown.resize(10);                                           // returns to small memory
  grown.shrink_to_fit();
  EXPECT_THAT(grown, ::testing::Each(0));
  EXPECT_EQ(mask, copy);
}

TEST(VoxelMask, VoxelsThatShareAFaceAreInOneComponent) {
  const VoxelMask mask = RandomMask(2, 0.35);
  const VoxelComponents pieces = LabelComponents(mask, kGrid);
  std::int64_t total = 0;
  for (const std::int64_t size : pieces.sizes) {
    total += size;
  }
  EXPECT_EQ(total, std::count(mask.begin(), mask.end(), 1));
  const std::vector<int> of_voxel = ComponentOfVoxels(pieces);
  for (std::int64_t a = 0; a < kGrid.Count(); ++a) {
    EXPECT_EQ(of_voxel[a] < 0, mask[a] == 0);
    for (std::int64_t b = 0; b < a; ++b) {
      if (mask[a] && mask[b] && ShareAFace(a, b)) {
        EXPECT_EQ(of_voxel[a], of_voxel[b]);
      }
    }
  }
}

// With the test above: no two components touch, and each is connected.
TEST(VoxelMask, ComponentsAreConnectedAndNumberedByTheirFirstVoxel) {
  const VoxelMask mask = RandomMask(5, 0.35);
  const VoxelComponents pieces = LabelComponents(mask, kGrid);
  const std::vector<int> of_voxel = ComponentOfVoxels(pieces);
  int next = 0;
  for (std::int64_t n = 0; n < kGrid.Count(); ++n) {
    EXPECT_LE(of_voxel[n], next);
    next = std::max(next, of_voxel[n] + 1);
  }
  for (int piece = 0; piece < next; ++piece) {
    VoxelMask start(mask.size(), 0);
    start[std::find(of_voxel.begin(), of_voxel.end(), piece) - of_voxel.begin()] = 1;
    bool more = true;
    while (more) {  // grows the start by one voxel at a time
      more = false;
      for (std::int64_t a = 0; a < kGrid.Count(); ++a) {
        for (std::int64_t b = 0; b < kGrid.Count() && mask[a] && !start[a]; ++b) {
          if (start[b] && ShareAFace(a, b)) {
            start[a] = 1;
            more = true;
          }
        }
      }
    }
    EXPECT_EQ(std::count(start.begin(), start.end(), 1), pieces.sizes[piece]);
  }
}

TEST(VoxelMask, AFloodIsTheComponentsThatContainASeed) {
  const VoxelMask allowed = RandomMask(3, 0.4), seeds = RandomMask(4, 0.05);
  const VoxelMask reached = Flood(allowed, seeds, kGrid);
  const VoxelComponents pieces = LabelComponents(allowed, kGrid);
  const std::vector<int> of_voxel = ComponentOfVoxels(pieces);
  std::vector<bool> has_seed(pieces.sizes.size(), false);
  for (std::int64_t n = 0; n < kGrid.Count(); ++n) {
    if (allowed[n] && seeds[n]) {
      has_seed[of_voxel[n]] = true;
    }
  }
  for (std::int64_t n = 0; n < kGrid.Count(); ++n) {
    EXPECT_EQ(reached[n] != 0, allowed[n] && has_seed[of_voxel[n]]);
  }
}

}  // namespace
}  // namespace semblance::problems
