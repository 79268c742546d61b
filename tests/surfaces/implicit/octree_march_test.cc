// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/implicit/octree_march.h"

#include <gtest/gtest.h>

#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

class EmitterCacheTest : public ::testing::Test {
 protected:
  // Gets some emitters at a corner and returns the number of evaluations.
  std::int64_t Ask(const GridIndex& corner, const std::vector<std::int32_t>& emitters) {
    std::vector<double> values(emitters.size(), kNaN), exact(emitters.size(), kNaN);
    std::int64_t evaluations = 0;
    cache_.Get(corner, emitters, values, evaluations);
    surface_.EmissionsAt(grid_.Corner(corner), emitters, exact);
    EXPECT_EQ(values, exact);
    return evaluations;
  }

  const TriMesh skull_ = testing::SphereMesh({0, 0, 0}, 20, 6);
  const ImplicitSurface surface_{skull_, std::vector<double>(skull_.points.size(), 4.0), {}};
  const SampleGrid grid_{Vec3::Constant(-32), Vec3::Constant(8), {9, 9, 9}};
  EmitterCache cache_{surface_, grid_, 8};
};

TEST_F(EmitterCacheTest, EvaluatesEachEmitterOnceAtACorner) {
  EXPECT_EQ(Ask({1, 2, 3}, {2, 5, 9}), 3);
  EXPECT_EQ(Ask({1, 2, 3}, {2, 5, 9}), 0);
  EXPECT_EQ(Ask({1, 2, 3}, {5}), 0);
  EXPECT_EQ(Ask({1, 2, 3}, {0, 5, 7, 9, 11}), 3);
  EXPECT_EQ(Ask({1, 2, 3}, {0, 2, 5, 7, 9, 11}), 0);
  EXPECT_EQ(Ask({2, 1, 3}, {2}), 1);  // another column
}

// In a grid of 8 cells the layers 0, 2, 3, 4 and 8 bound nodes around the slice from 2 to 3.
TEST_F(EmitterCacheTest, KeepsOneLayerOfEachDepthAndThatOfZero) {
  for (const int k : {0, 8, 4, 2, 3}) {
    EXPECT_EQ(Ask({4, 4, k}, {1, 2}), 2) << k;
  }
  for (const int k : {0, 8, 4, 2, 3}) {
    EXPECT_EQ(Ask({4, 4, k}, {1, 2}), 0) << k;
  }
  EXPECT_EQ(Ask({4, 4, 5}, {1, 2}), 2);  // layers 5 and 3 have depth 3
  EXPECT_EQ(Ask({4, 4, 3}, {1, 2}), 2);
  EXPECT_EQ(Ask({4, 4, 2}, {1, 2}), 0);
  EXPECT_EQ(Ask({4, 4, 6}, {1, 2}), 2);  // layers 6 and 2 have depth 2
  EXPECT_EQ(Ask({4, 4, 2}, {1, 2}), 2);
  EXPECT_EQ(Ask({4, 4, 4}, {1, 2}), 0);
}

}  // namespace
}  // namespace semblance::surfaces
