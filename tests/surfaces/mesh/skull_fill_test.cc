// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/skull_fill.h"

#include <gtest/gtest.h>

#include "surfaces/base/error.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

TEST(Remesh, MakesEdgesOfTheLengthAsked) {
  const TriMesh even = Remesh(testing::SphereMesh({0, 0, 0}, 50, 20), 4);
  const EdgeReport edges = CheckEdges(even);
  EXPECT_EQ(edges.boundary + edges.non_manifold + edges.inconsistent, 0);
  EXPECT_GT(SignedVolume(even), 0);
  double sum = 0;
  for (const Triangle& t : even.triangles) {
    sum += (even.points[t[0]] - even.points[t[1]]).norm();
  }
  EXPECT_NEAR(sum / static_cast<double>(even.triangles.size()), 4, 0.6);
}

TEST(Remesh, RefusesWhatItCannotTake) {
  TriMesh turned = testing::Plate(10, 4);
  EXPECT_THROW(Remesh(turned, 0), InputError);
  std::swap(turned.triangles[7][0], turned.triangles[7][1]);
  EXPECT_THROW(Remesh(turned, 4), InputError);
}

}  // namespace
}  // namespace semblance::surfaces
