// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/join_copies.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>

#include "surfaces/mesh/mesh_check.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Joined;
using testing::Shuffled;
using testing::SphereMesh;

const TriMesh kBall = SphereMesh({10, 20, 30}, 90, 20);

TriMesh Soup(const TriMesh& mesh) {
  TriMesh soup;
  for (const Triangle& t : mesh.triangles) {
    const auto first = static_cast<std::int32_t>(soup.points.size());
    for (const std::int32_t v : t) {
      soup.points.push_back(mesh.points[v]);
    }
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

TriMesh Reversed(TriMesh mesh) {
  for (Triangle& t : mesh.triangles) {
    std::swap(t[0], t[1]);
  }
  return mesh;
}

TriMesh Moved(TriMesh mesh, double by_mm) {
  for (Vec3& p : mesh.points) {
    p += Vec3(by_mm, -by_mm, by_mm);
  }
  return mesh;
}

TriMesh InSinglePrecision(TriMesh mesh) {
  for (Vec3& p : mesh.points) {
    p = p.cast<float>().cast<double>();
  }
  return mesh;
}

struct Writing {
  const char* name;
  TriMesh mesh;
};

TEST(JoinCopies, EveryWayToWriteABallGivesTheBall) {
  const TriMesh& b = kBall;
  const Writing writings[] = {
      {"three copies", Joined(Joined(b, b), b)},
      {"copy in single precision", Joined(b, InSinglePrecision(b))},
      {"copy moved by 1e-4 mm", Joined(b, Moved(b, 1e-4))},
      {"reversed copy", Joined(b, Reversed(b))},
      {"reversed copy, shuffled", Shuffled(Joined(b, Reversed(b)))},
      {"soup", Soup(b)},
      {"soup of copies", Soup(Joined(b, b))},
      {"soup of both sides, shuffled", Shuffled(Soup(Joined(b, Reversed(b))))},
  };
  for (const auto& [name, mesh] : writings) {
    TriMesh joined = mesh;
    EXPECT_FALSE(JoinCopies(joined, "skull.ply").empty()) << name;
    EXPECT_EQ(joined.points.size(), b.points.size()) << name;
    EXPECT_EQ(joined.triangles.size(), b.triangles.size()) << name;
    EXPECT_NEAR(SignedVolume(joined), SignedVolume(b), 1) << name;
    const EdgeReport edges = CheckEdges(joined);
    EXPECT_EQ(edges.boundary + edges.non_manifold + edges.inconsistent, 0) << name;
  }
}

TEST(JoinCopies, SaysWhatItDid) {
  TriMesh copies = Joined(kBall, kBall);
  EXPECT_THAT(JoinCopies(copies, "skull.ply"),
              ElementsAre(HasSubstr("skull.ply: 1520 of 3040 triangles lie on others")));
  TriMesh soup = Soup(kBall);
  EXPECT_THAT(JoinCopies(soup, "skull.ply"), ElementsAre(HasSubstr("corners are joined")));
}

TEST(JoinCopies, ASoundMeshKeepsItsBits) {
  std::vector<bool> keep(kBall.triangles.size(), true);
  std::fill(keep.begin() + 100, keep.begin() + 200, false);
  for (const TriMesh& mesh : {kBall, Submesh(kBall, keep), Joined(kBall, Moved(kBall, 1))}) {
    TriMesh same = mesh;
    EXPECT_THAT(JoinCopies(same, "skull.ply"), IsEmpty());
    EXPECT_EQ(same.points, mesh.points);
    EXPECT_EQ(same.triangles, mesh.triangles);
  }
}

TEST(JoinCopies, ASecondVersionOfTheSurfaceIsNoted) {
  EXPECT_THAT(CheckHeadMesh(Joined(kBall, SphereMesh({10, 20, 30}, 90.05, 23)), "skull.ply"),
              ElementsAre(HasSubstr("second sheet within 0.25 mm")));
  EXPECT_THAT(CheckHeadMesh(Joined(kBall, Reversed(SphereMesh({10, 20, 30}, 84, 20))), "skull.ply"),
              IsEmpty());
}

}  // namespace
}  // namespace semblance::surfaces
