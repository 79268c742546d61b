// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/closed_mesh/closed_rings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/testing/closed_shapes.h"
#include "tests/testing/shapes.h"

namespace semblance {
namespace {

// From its least vertex on.
Ring Rotated(Ring ring) {
  if (!ring.empty()) {
    std::rotate(ring.begin(), std::ranges::min_element(ring), ring.end());
  }
  return ring;
}

TEST(ClosedRings, WhatIsTakenApartIsPutTogetherAgain) {
  for (const TriMesh& mesh : {testing::SphereMesh({1, 2, 3}, 10, 9),
                              testing::MeshOf(testing::EllipsoidWithEars(), 500, 0)}) {
    const std::vector<Ring> whole = RingsOf(mesh);
    ClosedRings closed = TakeApart(mesh);
    EXPECT_EQ(closed.removals.size(), mesh.points.size() - 4);
    EXPECT_EQ(std::ranges::count_if(closed.rings, [](const Ring& r) { return r.size() == 3; }), 4);
    while (!closed.removals.empty()) {
      PutBack(closed.removals.back(), closed.rings);
      closed.removals.pop_back();
    }
    for (std::size_t v = 0; v < whole.size(); ++v) {
      EXPECT_EQ(Rotated(closed.rings[v]), whole[v]);
    }
  }
}

TEST(ClosedRings, ARoundLeavesThreeQuarters) {
  const TriMesh mesh = testing::SphereMesh({0, 0, 0}, 10, 30);
  const ClosedRings closed = TakeApart(mesh);
  ASSERT_GT(closed.rounds.size(), 5u);
  EXPECT_EQ(closed.rounds[0], 0u);
  EXPECT_NEAR(static_cast<double>(closed.rounds[1]), 0.25 * mesh.points.size(), 1);
}

TEST(ClosedRings, ATetrahedronIsLeftAsItIs) {
  const TriMesh mesh{.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                     .triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
  const ClosedRings closed = TakeApart(mesh);
  EXPECT_TRUE(closed.removals.empty());
  EXPECT_EQ(closed.rings, RingsOf(mesh));
}

}  // namespace
}  // namespace semblance
