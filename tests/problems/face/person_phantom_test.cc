// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/person_phantom.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "problems/face/person_scan.h"
#include "problems/subject/tissue_table.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

PersonPhantom Make(std::uint64_t random_seed, int threads) {
  RunContext context;
  context.threads = threads;
  return MakePersonPhantom(random_seed, context);
}

const PersonPhantom& First() {
  static const PersonPhantom person = Make(1, 2);
  return person;
}

bool SamePoints(const TriMesh& a, const TriMesh& b) {
  return std::ranges::equal(a.points, b.points) && a.triangles == b.triangles;
}

// Where a ray meets a triangle, as the way along it (Moeller & Trumbore 1997); none if it does not.
std::optional<double> Hit(const TriMesh& mesh, const Triangle& t, const Vec3& from,
                          const Vec3& along) {
  const Vec3 a = mesh.points[t[0]], ab = mesh.points[t[1]] - a, ac = mesh.points[t[2]] - a;
  const Vec3 p = along.cross(ac);
  const double det = ab.dot(p);
  if (det == 0) {
    return std::nullopt;
  }
  const Vec3 s = from - a, q = s.cross(ab);
  const double u = s.dot(p) / det, v = along.dot(q) / det, way = ac.dot(q) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && way > 0 ? std::optional(way) : std::nullopt;
}

std::vector<double> Hits(const TriMesh& mesh, const Vec3& from, const Vec3& along) {
  std::vector<double> ways;
  for (const Triangle& t : mesh.triangles) {
    if (const std::optional<double> way = Hit(mesh, t, from, along)) {
      ways.push_back(*way);
    }
  }
  std::ranges::sort(ways);
  return ways;
}

TEST(PersonPhantom, TheSeedAloneDecidesThorough) {
  const PersonPhantom again = Make(1, 1), other = Make(2, 2);
  EXPECT_TRUE(SamePoints(First().skull, again.skull));
  EXPECT_TRUE(SamePoints(First().true_skin, again.true_skin));
  EXPECT_EQ(First().build, again.build);
  EXPECT_FALSE(SamePoints(First().skull, other.skull));
  EXPECT_FALSE(SamePoints(First().true_skin, other.true_skin));
}

TEST(PersonPhantom, SkinAndClosingAreClosed) {
  for (const TriMesh* mesh : {&First().skin, &First().closing}) {
    const EdgeReport edges = CheckEdges(*mesh);
    EXPECT_EQ(edges.boundary, 0);
    EXPECT_EQ(edges.non_manifold, 0);
    EXPECT_EQ(edges.inconsistent, 0);
  }
}

// A ray from a point inside leaves the skin once more than it enters.
TEST(PersonPhantom, TheSkullLiesUnderTheSkin) {
  const TriMesh& skull = First().skull;
  const MeshQuery skin(First().true_skin);
  for (std::size_t v = 0; v < skull.points.size(); v += 97) {
    const Vec3& p = skull.points[v];
    EXPECT_GT(skin.Closest(p).distance_mm, 1.9) << p.transpose();
    const Vec3 along = Vec3(0.31, 0.87, 0.43).normalized();  // backwards, away from the openings
    EXPECT_EQ(Hits(First().skin, p, along).size() % 2, 1u) << p.transpose();
  }
}

TEST(PersonPhantom, TheDepthIsTheWayToTheSkin) {
  ASSERT_GE(First().sites.size(), 28u);
  for (const PhantomSite& site : First().sites) {
    const std::vector<double> ways = Hits(First().true_skin, site.base, site.normal);
    ASSERT_FALSE(ways.empty()) << site.site;
    EXPECT_NEAR(ways.front(), site.depth_mm, 1e-9) << site.site;
    EXPECT_NEAR(site.normal.norm(), 1, 1e-12);
  }
}

// Depths of one person scatter about those of people. A wrong unit or a skull in another place
// would not.
TEST(PersonPhantom, DepthsAreThoseOfPeople) {
  double sum = 0;
  int n = 0;
  for (const PhantomSite& site : First().sites) {
    if (const auto published = FindPublishedDepth(site.site)) {
      const double ratio = std::log(site.depth_mm / published->mean_mm);
      EXPECT_LT(std::abs(ratio), std::log(2.5)) << site.site << " " << site.depth_mm;
      sum += ratio;
      ++n;
    }
  }
  EXPECT_LT(std::abs(sum / n), 0.3);
}

// The foremost skin of the midline is the nose; lips and chin lie in front of the hollow between.
TEST(PersonPhantom, HasANose) {
  const auto site = [](const char* code) {
    return std::ranges::find(First().sites, code, &PhantomSite::site)->base;
  };
  double nose = 0, brow = 0;
  for (const Vec3& p : First().true_skin.points) {
    const double height = p.z() - site("n").z(), front = site("n").y() - p.y();
    if (std::abs(p.x() - site("n").x()) < 5 && height > -60 && height < -25) {
      nose = std::max(nose, front);
    } else if (std::abs(p.x() - site("n").x()) < 5 && height > 0 && height < 15) {
      brow = std::max(brow, front);
    }
  }
  EXPECT_GT(nose, brow + 10);
}

TEST(PersonPhantom, TheScanShowsBoneUnderTissueInAir) {
  const CtVolume volume =
      VoxelisePerson(First(), {.pixel_mm = 2, .slice_mm = 2, .bone_mm = 7, .threads = 2});
  int bone = 0;
  for (const PhantomSite& site : First().sites) {
    bone += SampleHu(volume, site.base - 2.5 * site.normal) > 300 ? 1 : 0;
    EXPECT_NEAR(SampleHu(volume, site.base + site.depth_mm / 2 * site.normal), 40, 500)
        << site.site;
    EXPECT_LT(SampleHu(volume, site.base + (site.depth_mm + 5) * site.normal), -700) << site.site;
  }
  // Bone at a few sites is thinner than a voxel.
  EXPECT_GE(bone, static_cast<int>(First().sites.size()) - 3);
}

// The nasion of a person may be doubtful, and then it is no landmark.
TEST(PersonPhantom, TheScanNeedsNoLandmark) {
  const PhantomCtOptions coarse{.pixel_mm = 6, .slice_mm = 6, .threads = 2};
  PersonPhantom without = First();
  std::erase_if(without.sites, [](const PhantomSite& site) { return site.site == "n"; });
  EXPECT_EQ(VoxelisePerson(without, coarse).values, VoxelisePerson(First(), coarse).values);
}

TEST(PersonPhantom, ThreadsChangeNoVoxel) {
  const PhantomCtOptions one{.pixel_mm = 6, .slice_mm = 6, .threads = 1};
  PhantomCtOptions three = one;
  three.threads = 3;
  EXPECT_EQ(VoxelisePerson(First(), one).values, VoxelisePerson(First(), three).values);
}

}  // namespace
}  // namespace semblance::problems
