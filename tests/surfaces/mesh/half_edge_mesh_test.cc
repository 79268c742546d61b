// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/half_edge_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using testing::Joined;
using testing::Plate;
using testing::SphereMesh;

// A plate with a third triangle at an inner edge.
TriMesh Finned() {
  TriMesh mesh = Plate(10, 4);
  mesh.points.emplace_back(5, 5, 5);
  mesh.triangles.push_back({6, 7, 25});
  return mesh;
}

TriMesh WithOneTurned() {
  TriMesh mesh = Plate(10, 4);
  std::swap(mesh.triangles[7][0], mesh.triangles[7][1]);
  return mesh;
}

// Two plates that share one corner.
TriMesh Pinched() {
  TriMesh mesh = Joined(Plate(10, 4), Plate(10, 4));
  for (Triangle& t : mesh.triangles) {
    std::ranges::replace(t, 25, 24);
  }
  return mesh;
}

// Random triangles on few points, with every kind of defect.
TriMesh Soup() {
  Random random(11);
  TriMesh mesh;
  for (int k = 0; k < 30; ++k) {
    mesh.points.push_back(random.InBox(-10, 10));
  }
  for (int k = 0; k < 200; ++k) {
    const Vec3 corners = random.InBox(0, 29.999);
    mesh.triangles.push_back({int(corners[0]), int(corners[1]), int(corners[2])});
  }
  return mesh;
}

Triangle Corners(const HalfEdgeMesh& mesh, std::size_t face) {
  Triangle t;
  std::size_t c = 0;
  for (const auto v : mesh.fv_range(OpenMesh::FaceHandle(int(face)))) {
    t[c++] = v.idx();
  }
  return t;
}

TEST(HalfEdgeMesh, KeepsTheIndicesOfPointsAndTriangles) {
  const TriMesh sphere = SphereMesh({1, 2, 3}, 10, 8);
  const HalfEdges half_edges = MakeHalfEdges(sphere);
  EXPECT_TRUE(half_edges.refused.empty() && half_edges.copy_of.empty());
  ASSERT_EQ(half_edges.mesh.n_faces(), sphere.triangles.size());
  for (std::size_t v = 0; v < sphere.points.size(); ++v) {
    EXPECT_EQ(half_edges.mesh.point(OpenMesh::VertexHandle(int(v))), sphere.points[v]);
  }
  for (std::size_t t = 0; t < sphere.triangles.size(); ++t) {
    EXPECT_EQ(Corners(half_edges.mesh, t), sphere.triangles[t]);
  }
}

TEST(HalfEdgeMesh, LosesNoTriangleAndCopiesJoinAgain) {
  for (const TriMesh& mesh : {Finned(), WithOneTurned(), Pinched(), Soup()}) {
    const HalfEdges half_edges = MakeHalfEdges(mesh);
    ASSERT_EQ(half_edges.mesh.n_faces(), mesh.triangles.size());
    ASSERT_EQ(half_edges.mesh.n_vertices(), mesh.points.size() + half_edges.copy_of.size());
    EXPECT_EQ(half_edges.copy_of.size(), 3 * half_edges.refused.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      Triangle corners = Corners(half_edges.mesh, t);
      for (std::int32_t& v : corners) {
        const int copy = v - int(mesh.points.size());
        v = copy < 0 ? v : half_edges.copy_of[copy];
      }
      EXPECT_EQ(corners, mesh.triangles[t]);
    }
  }
}

TEST(HalfEdgeMesh, NoTwoFacesRunAlongAnEdgeTheSameWay) {
  const HalfEdges half_edges = MakeHalfEdges(Soup());
  std::set<std::pair<int, int>> sides;
  for (std::size_t t = 0; t < half_edges.mesh.n_faces(); ++t) {
    const Triangle corners = Corners(half_edges.mesh, t);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_TRUE(sides.insert({corners[c], corners[(c + 1) % 3]}).second);
    }
  }
}

TEST(HalfEdgeMesh, ManifoldsAreMadeAndOthersRefused) {
  EXPECT_EQ(MakeManifold(Plate(10, 4), "test").n_faces(), 32u);
  EXPECT_EQ(MakeManifold(SphereMesh({0, 0, 0}, 1, 8), "test").n_faces(), 224u);
  TriMesh folded = Plate(10, 4);
  folded.triangles.push_back({3, 3, 4});
  for (const TriMesh& mesh : {Finned(), WithOneTurned(), Pinched(), Soup(), folded}) {
    EXPECT_THROW(MakeManifold(mesh, "test"), InputError);
  }
}

// Oracle: per border vertex, the next one in the direction of the triangle there.
std::map<std::int32_t, std::int32_t> NextOnBorder(const TriMesh& mesh) {
  std::set<std::pair<std::int32_t, std::int32_t>> sides;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t c = 0; c < 3; ++c) {
      sides.insert({t[c], t[(c + 1) % 3]});
    }
  }
  std::map<std::int32_t, std::int32_t> next;
  for (const auto& [from, to] : sides) {
    if (!sides.contains({to, from})) {
      next[from] = to;
    }
  }
  return next;
}

TEST(HalfEdgeMesh, BorderLoopsFollowTheBorderWithTheSurfaceOnTheLeft) {
  const TriMesh plate = Plate(60, 12);
  std::vector<bool> keep;
  for (const Triangle& t : plate.triangles) {
    const Vec3 c = TriangleCentroid(plate, t);
    keep.push_back((c - Vec3(15, 15, 0)).norm() > 7 && (c - Vec3(42, 40, 0)).norm() > 12);
  }
  const TriMesh holed = Submesh(plate, keep);
  std::map<std::int32_t, std::int32_t> next = NextOnBorder(holed);
  const std::vector<VertexLoop> loops = BorderLoops(holed, "test");
  ASSERT_EQ(loops.size(), 3u);
  std::int32_t last_start = -1;
  for (const VertexLoop& loop : loops) {
    EXPECT_EQ(loop.front(), *std::ranges::min_element(loop));
    EXPECT_GT(loop.front(), last_start);
    last_start = loop.front();
    for (std::size_t k = 0; k < loop.size(); ++k) {
      EXPECT_EQ(next.at(loop[k]), loop[(k + 1) % loop.size()]);
      next.erase(loop[k]);
    }
  }
  EXPECT_TRUE(next.empty());
  EXPECT_TRUE(BorderLoops(SphereMesh({0, 0, 0}, 1, 8), "test").empty());
  EXPECT_THROW(BorderLoops(Finned(), "test"), InputError);
}

// Oracle: two neighbours follow each other in the ring of a vertex if and only if they make a
// triangle with it.
TEST(HalfEdgeMesh, RingsGoAroundTheirVertex) {
  for (const TriMesh& mesh : {Plate(10, 4), SphereMesh({0, 0, 0}, 1, 8)}) {
    const std::vector<VertexLoop> rings = VertexRings(mesh, "test");
    const std::map<std::int32_t, std::int32_t> border = NextOnBorder(mesh);
    std::map<std::int32_t, std::set<std::pair<std::int32_t, std::int32_t>>> pairs, expected;
    for (const Triangle& t : mesh.triangles) {
      for (std::size_t c = 0; c < 3; ++c) {
        expected[t[c]].insert({t[(c + 1) % 3], t[(c + 2) % 3]});
      }
    }
    for (std::int32_t v = 0; v < std::ssize(rings); ++v) {
      const VertexLoop& ring = rings[v];
      for (std::size_t k = border.contains(v) ? 1 : 0; k < ring.size(); ++k) {
        pairs[v].insert({ring[(k + ring.size() - 1) % ring.size()], ring[k]});
      }
    }
    EXPECT_EQ(pairs, expected);
  }
}

}  // namespace
}  // namespace semblance::surfaces
