// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/neighbour_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using testing::Joined;
using testing::Plate;
using testing::Shuffled;
using testing::SphereMesh;

// Two pieces, and a point that no triangle has.
TriMesh TwoPieces() {
  TriMesh mesh = Joined(SphereMesh({0, 0, 0}, 10, 60), Plate(30, 60));
  mesh.points.emplace_back(1, 2, 3);
  return mesh;
}

TEST(NeighbourOrder, AMeshThatIsStoredRowByRowIsNotScatteredAndAShuffledOneIs) {
  EXPECT_FALSE(IsScattered(Plate(30, 60)));
  EXPECT_FALSE(IsScattered(SphereMesh({0, 0, 0}, 10, 60)));
  EXPECT_TRUE(IsScattered(Shuffled(Plate(30, 60))));
}

TEST(NeighbourOrder, AShuffledMeshIsNoMoreScatteredAndIsTheSame) {
  const TriMesh mesh = Shuffled(TwoPieces());
  const OrderedMesh ordered = InOrderOfNeighbours(mesh);
  EXPECT_FALSE(IsScattered(ordered.mesh));
  ASSERT_EQ(ordered.vertices.size(), mesh.points.size());
  ASSERT_EQ(ordered.triangles.size(), mesh.triangles.size());
  for (std::size_t v = 0; v < ordered.vertices.size(); ++v) {
    EXPECT_EQ(ordered.mesh.points[v], mesh.points[ordered.vertices[v]]);
  }
  std::vector<std::int32_t> all(mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0);
  TriMesh back = ordered.mesh;
  PutBackInOrder(ordered, all, back);
  EXPECT_EQ(back.points, mesh.points);
  EXPECT_EQ(back.triangles, mesh.triangles);
}

TEST(NeighbourOrder, APartKeepsTheOrderOfTheWhole) {
  const TriMesh mesh = Shuffled(TwoPieces());
  const OrderedMesh ordered = InOrderOfNeighbours(mesh);
  TriMesh part{ordered.mesh.points, {}};
  std::vector<std::int32_t> left;
  for (std::int32_t t = 0; t < std::ssize(ordered.mesh.triangles); t += 3) {
    left.push_back(t);
    part.triangles.push_back(ordered.mesh.triangles[t]);
  }
  PutBackInOrder(ordered, left, part);
  ASSERT_EQ(part.triangles.size(), left.size());
  auto at = mesh.triangles.begin();
  for (const Triangle& t : part.triangles) {
    at = std::find(at, mesh.triangles.end(), t);
    ASSERT_NE(at, mesh.triangles.end());
  }
}

}  // namespace
}  // namespace semblance::surfaces
