// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/ct/voxel_mask.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance {
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

bool ShareAFace(std::int64_t a, std::int64_t b) {
  const Vec3 d = (Centre(a) - Centre(b)).cwiseAbs().cwiseQuotient(kGrid.spacing_mm);
  return std::lround(d.sum()) == 1;
}

TEST(VoxelMask, GrowIsTheBruteForceDistance) {
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

TEST(VoxelMask, PiecesAreThoseOfAGraphSearch) {
  const VoxelMask mask = RandomMask(2, 0.35);
  const VoxelComponents pieces = LabelComponents(mask, kGrid);
  std::int64_t total = 0;
  for (const std::int64_t size : pieces.sizes) {
    total += size;
  }
  EXPECT_EQ(total, std::count(mask.begin(), mask.end(), 1));
  for (std::int64_t a = 0; a < kGrid.Count(); ++a) {
    EXPECT_EQ(pieces.of_voxel[a] < 0, mask[a] == 0);
    for (std::int64_t b = 0; b < a; ++b) {
      if (mask[a] && mask[b] && ShareAFace(a, b)) {
        EXPECT_EQ(pieces.of_voxel[a], pieces.of_voxel[b]);
      }
    }
  }
}

TEST(VoxelMask, AFloodIsThePiecesThatItsSeedsTouch) {
  const VoxelMask allowed = RandomMask(3, 0.4), seeds = RandomMask(4, 0.05);
  const VoxelMask reached = Flood(allowed, seeds, kGrid);
  const VoxelComponents pieces = LabelComponents(allowed, kGrid);
  std::vector<bool> wet(pieces.sizes.size(), false);
  for (std::int64_t n = 0; n < kGrid.Count(); ++n) {
    if (allowed[n] && seeds[n]) {
      wet[pieces.of_voxel[n]] = true;
    }
  }
  for (std::int64_t n = 0; n < kGrid.Count(); ++n) {
    EXPECT_EQ(reached[n] != 0, allowed[n] && wet[pieces.of_voxel[n]]);
  }
}

}  // namespace
}  // namespace semblance
