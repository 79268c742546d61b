// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/phantom.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <sstream>

#include "interp/evaluation/variogram.h"
#include "problems/subject/dowel_placement.h"
#include "problems/subject/phantom_shape.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

// The areas of the right side of the thesis's network, by the thesis's numbers of the sites.
constexpr const char* kAreas =
    "1 11 12 1 12 2 2 12 3 3 12 13 3 13 4 4 13 14 4 14 5 5 14 19 5 19 6 6 19 20 6 20 7 7 20 21 "
    "7 21 8 8 21 9 9 21 18 9 18 10 11 15 12 12 15 13 13 15 14 14 15 16 14 16 19 16 20 19 16 17 20 "
    "17 18 20 18 21 20 11 16 15 11 17 16";
const std::vector<std::string> kCodes = {"sg", "g",  "n",   "rhi", "mp",  "pr",  "id",
                                         "sm", "pg", "me",  "fe",  "mso", "mio", "im",
                                         "lo", "zy", "sgl", "go",  "sM2", "mr",  "iM2"};

std::vector<std::uint8_t> Bytes(const Phantom& p) {
  std::vector<std::uint8_t> bytes;
  const auto add = [&](const auto* data, std::size_t count) {
    const auto* from = reinterpret_cast<const std::uint8_t*>(data);
    bytes.insert(bytes.end(), from, from + count * sizeof(*data));
  };
  add(p.skull.points.data(), p.skull.points.size());
  add(p.skull.triangles.data(), p.skull.triangles.size());
  add(p.depth_mm.data(), p.depth_mm.size());
  add(p.face.points.data(), p.face.points.size());
  for (const PhantomSite& s : p.sites) {
    add(s.base.data(), 3);
    add(s.normal.data(), 3);
    add(&s.depth_mm, 1);
  }
  return bytes;
}

// A mesh of the sites' bases joined by the areas of both sides.
TriMesh SiteMesh(const Phantom& p) {
  std::map<std::string, int> index;
  TriMesh mesh;
  for (const PhantomSite& s : p.sites) {
    index[s.site] = static_cast<int>(mesh.points.size());
    mesh.points.push_back(s.base);
  }
  for (const char* side : {"_r", "_l"}) {
    std::istringstream numbers(kAreas);
    for (int a, b, c; numbers >> a >> b >> c;) {
      const auto at = [&](int n) { return index.at(kCodes[n - 1] + (n > 10 ? side : "")); };
      mesh.triangles.push_back({at(a), at(b), at(c)});
    }
  }
  return mesh;
}

// The depth interpolated linearly over the area through which the ray to `vertex` leaves; NaN if
// there is none.
double InterpolatedDepth(const Phantom& p, const TriMesh& sites, const MeshQuery& query,
                         const Vec3& vertex) {
  const auto hit = query.FirstHit(p.centre, vertex - p.centre, 400);
  if (!hit) {
    return kNaN;
  }
  Mat3 corners;
  Vec3 depths;
  for (int i = 0; i < 3; ++i) {
    const int site = sites.triangles[hit->triangle][i];
    corners.col(i) = sites.points[site] - p.centre;
    depths[i] = p.sites[site].depth_mm;
  }
  return depths.dot(corners.inverse() * (hit->position - p.centre));
}

double WorstTurnDegrees(const TriMesh& from, const TriMesh& to) {
  double cosine = 1;
  for (const Triangle& t : from.triangles) {
    cosine = std::min(cosine, TriangleAreaVector(from, t).normalized().dot(
                                  TriangleAreaVector(to, t).normalized()));
  }
  return std::acos(cosine) * 180 / std::numbers::pi;
}

class PhantomOfSeed : public ::testing::TestWithParam<int> {
 protected:
  const Phantom phantom_ = MakePhantom({.random_seed = static_cast<std::uint64_t>(GetParam())});
};
INSTANTIATE_TEST_SUITE_P(Seeds, PhantomOfSeed, ::testing::Range(1, 6));

TEST_P(PhantomOfSeed, SkullIsClosedAndOutwardAndOfAdultSize) {
  const TriMesh& skull = phantom_.skull;
  const EdgeReport edges = CheckEdges(skull);
  EXPECT_EQ(edges.boundary + edges.non_manifold + edges.inconsistent, 0);
  EXPECT_EQ(ConnectedComponents(skull).count, 1);
  // Euler's number 2: one closed surface with the topology of a sphere.
  EXPECT_EQ(static_cast<std::int64_t>(skull.points.size()) - edges.edges +
                static_cast<std::int64_t>(skull.triangles.size()),
            2);
  const Vec3 size = Bounds(skull).sizes();
  EXPECT_NEAR(size.x(), 145, 12);
  EXPECT_NEAR(size.y(), 190, 10);
  EXPECT_NEAR(size.z(), 200, 10);
  EXPECT_NEAR(SignedVolume(skull), 2.4e6, 0.4e6);
  EXPECT_LT(Bounds(skull).center().head<1>().norm(), 4);
}

TEST_P(PhantomOfSeed, EveryRayFromTheCentreLeavesOutward) {
  for (const Triangle& t : phantom_.skull.triangles) {
    const Vec3 ray = TriangleCentroid(phantom_.skull, t) - phantom_.centre;
    ASSERT_GT(ray.normalized().dot(TriangleAreaVector(phantom_.skull, t).normalized()), 0.2);
  }
}

TEST_P(PhantomOfSeed, FaceLiesTheDepthAlongTheNormalAboveTheSkull) {
  const std::vector<Vec3> normals = VertexNormals(phantom_.skull);
  ASSERT_EQ(phantom_.face.points.size(), normals.size());
  EXPECT_EQ(phantom_.face.triangles, phantom_.skull.triangles);
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Vec3 tissue = phantom_.face.points[i] - phantom_.skull.points[i];
    ASSERT_NEAR(tissue.norm(), phantom_.depth_mm[i], 1e-9);
    ASSERT_GT(tissue.normalized().dot(normals[i]), std::cos(0.04));
    ASSERT_GT(phantom_.depth_mm[i], 2.5);
    ASSERT_LT(phantom_.depth_mm[i], 20);
  }
}

TEST_P(PhantomOfSeed, NeitherTheFaceNorASheet20MmOutIsFolded) {
  EXPECT_LT(WorstTurnDegrees(phantom_.skull, phantom_.face), 60);
  TriMesh sheet = phantom_.skull;
  for (std::size_t i = 0; i < sheet.points.size(); ++i) {
    sheet.points[i] += 20 * (phantom_.face.points[i] - sheet.points[i]).normalized();
  }
  EXPECT_LT(WorstTurnDegrees(phantom_.skull, sheet), 60);
}

TEST_P(PhantomOfSeed, SitesLieOnTheSkullWithItsNormalAndDepth) {
  const MeshQuery skull(phantom_.skull);
  const MeshQuery face(phantom_.face);
  for (const PhantomSite& s : phantom_.sites) {
    EXPECT_LT(skull.Closest(s.base).distance_mm, 0.05) << s.site;
    EXPECT_LT(face.Closest(s.base + s.depth_mm * s.normal).distance_mm, 0.1) << s.site;
    EXPECT_NEAR(s.normal.norm(), 1, 1e-12);
    EXPECT_EQ(s.site.ends_with("_l"), s.base.x() > 5) << s.site;
    EXPECT_EQ(s.site.ends_with("_r"), s.base.x() < -5) << s.site;
  }
  EXPECT_LT(phantom_.sites[2].base.norm(), 1e-9) << "nasion is the origin";
}

TEST_P(PhantomOfSeed, LinearDepthsBetweenTheSitesAreNearlyRight) {
  const TriMesh sites = SiteMesh(phantom_);
  const MeshQuery query(sites);
  double sum = 0;
  int covered = 0;
  for (std::size_t i = 0; i < phantom_.depth_mm.size(); ++i) {
    const double depth = InterpolatedDepth(phantom_, sites, query, phantom_.skull.points[i]);
    if (std::isfinite(depth)) {
      sum += (depth - phantom_.depth_mm[i]) * (depth - phantom_.depth_mm[i]);
      ++covered;
    }
  }
  EXPECT_GT(covered, 4000);
  EXPECT_LT(std::sqrt(sum / covered), 0.6);
}

TEST(Phantom, SitesAreTheStandardOnesInTheirOrder) {
  std::vector<std::string> codes;
  for (const PhantomSite& s : MakePhantom({.rings = 8}).sites) {
    codes.push_back(s.site);
  }
  EXPECT_EQ(codes, StandardSiteCodes());
}

TEST(Phantom, SameSeedSameBytesAndAnotherSeedAnotherHead) {
  const Phantom a = MakePhantom({.random_seed = 7, .rings = 20});
  const Phantom b = MakePhantom({.random_seed = 8, .rings = 20});
  EXPECT_EQ(Bytes(a), Bytes(MakePhantom({.random_seed = 7, .rings = 20})));
  double bone = 0, tissue = 0;
  for (std::size_t i = 0; i < a.depth_mm.size(); ++i) {
    bone = std::max(bone, (a.skull.points[i] - b.skull.points[i]).norm());
    tissue = std::max(tissue, std::abs(a.depth_mm[i] - b.depth_mm[i]));
  }
  EXPECT_GT(bone, 1);
  EXPECT_GT(tissue, 0.5);
}

TEST(Phantom, SidesDifferMildly) {
  const std::vector<PhantomSite> sites = MakePhantom({.rings = 8}).sites;
  double largest = 0;
  for (std::size_t i = 10; i < sites.size(); i += 2) {
    const Vec3 mirrored = sites[i + 1].base.cwiseProduct(Vec3(-1, 1, 1));
    largest = std::max(largest, (sites[i].base - mirrored).norm());
  }
  EXPECT_GT(largest, 0.1);
  EXPECT_LT(largest, 5);
}

TEST(Phantom, RingsSetTheMeshAndNotTheSites) {
  const Phantom coarse = MakePhantom({.rings = 9}), fine = MakePhantom({.rings = 50});
  EXPECT_EQ(CheckEdges(coarse.skull).boundary, 0);
  EXPECT_EQ(fine.skull.triangles.size(), 3 * 50 * 50);
  for (std::size_t i = 0; i < fine.sites.size(); ++i) {
    EXPECT_EQ(coarse.sites[i].base, fine.sites[i].base);
  }
}

TEST(Phantom, RingsOutOfRangeAreNamed) {
  for (const int rings : {-1, 7, 1001}) {
    EXPECT_THROW(MakePhantom({.rings = rings}), InputError);
  }
}

TEST(PhantomShape, NormalIsThatOfTheSurfaceByDifferences) {
  Random random(3);
  const PhantomShape shape(random);
  const auto point = [&](const Vec3& x) {
    return Vec3(shape.Radius(x.normalized()) * x.normalized());
  };
  for (int i = 0; i < 500; ++i) {
    const Vec3 d = random.Direction();
    const Vec3 along = 1e-4 * d.unitOrthogonal(), across = d.cross(along);
    const Vec3 normal = (point(d + along) - point(d - along))
                            .cross(point(d + across) - point(d - across))
                            .normalized();
    EXPECT_LT((normal - shape.Normal(d)).norm(), 1e-6);
  }
}

PhantomOptions LikePeople(std::uint64_t random_seed, int rings) {
  return {.random_seed = random_seed, .rings = rings, .bone = PhantomBone::kLikePeople};
}

class PhantomLikePeople : public ::testing::TestWithParam<int> {
 protected:
  const Phantom phantom_ = MakePhantom(LikePeople(static_cast<std::uint64_t>(GetParam()), 60));
};
INSTANTIATE_TEST_SUITE_P(Seeds, PhantomLikePeople, ::testing::Range(1, 3));

TEST_P(PhantomLikePeople, HasTheSmoothOnesFace) {
  const Phantom smooth =
      MakePhantom({.random_seed = static_cast<std::uint64_t>(GetParam()), .rings = 60});
  const Vec3 moved = phantom_.centre - smooth.centre;  // nasion is the origin of both
  ASSERT_EQ(phantom_.face.points.size(), smooth.face.points.size());
  EXPECT_EQ(phantom_.face.triangles, smooth.face.triangles);
  for (std::size_t v = 0; v < smooth.face.points.size(); ++v) {
    ASSERT_LT((phantom_.face.points[v] - moved - smooth.face.points[v]).norm(), 1e-9);
  }
  EXPECT_LT(phantom_.sites[2].base.norm(), 1e-9) << "nasion";
}

TEST_P(PhantomLikePeople, TheBoneIsClosedAndOutward) {
  const EdgeReport edges = CheckEdges(phantom_.skull);
  EXPECT_EQ(edges.boundary + edges.non_manifold + edges.inconsistent, 0);
  EXPECT_EQ(ConnectedComponents(phantom_.skull).count, 1);
  EXPECT_GT(SignedVolume(phantom_.skull), 1.5e6);
  for (const Triangle& t : phantom_.skull.triangles) {
    const Vec3 ray = TriangleCentroid(phantom_.skull, t) - phantom_.centre;
    ASSERT_GT(ray.dot(TriangleAreaVector(phantom_.skull, t)), 0) << "folded";
  }
}

TEST_P(PhantomLikePeople, TheSkinLiesOutsideOfTheBone) {
  const MeshQuery skin(phantom_.face);
  for (const Vec3& bone : phantom_.skull.points) {
    const Vec3 outward = (bone - phantom_.centre).normalized();
    const auto hit = skin.FirstHit(bone, outward, 400);
    ASSERT_TRUE(hit.has_value());
    ASSERT_GT(hit->distance_mm, 1.5);
    ASSERT_LT(hit->distance_mm, 60);
    ASSERT_GT(skin.Closest(bone).distance_mm, 1);
  }
}

TEST_P(PhantomLikePeople, DepthsAreMeasuredAlongTheNormals) {
  const MeshQuery skin(phantom_.face);
  const std::vector<Vec3> normals = VertexNormals(phantom_.skull);
  const auto along = [&](const Vec3& base, const Vec3& normal) {
    return skin.FirstHit(base, normal, 400)->distance_mm;
  };
  for (std::size_t v = 0; v < normals.size(); ++v) {
    ASSERT_EQ(phantom_.depth_mm[v], along(phantom_.skull.points[v], normals[v]));
  }
  for (const PhantomSite& s : phantom_.sites) {
    EXPECT_EQ(s.depth_mm, along(s.base, s.normal)) << s.site;
  }
}

TEST_P(PhantomLikePeople, SitesLieOnTheBoneAndFaceAsItDoesAround) {
  const Phantom fine = MakePhantom(LikePeople(static_cast<std::uint64_t>(GetParam()), 200));
  const MeshQuery bone(fine.skull);
  ASSERT_EQ(fine.sites.size(), 32u);
  for (const PhantomSite& s : fine.sites) {
    const MeshPoint on_bone = bone.Closest(s.base);
    EXPECT_LT(on_bone.distance_mm, 0.3) << s.site;
    const Vec3 mean =
        AveragedNormal(fine.skull, bone, on_bone.triangle, {.center = s.base, .radius_mm = 3});
    EXPECT_GT(s.normal.dot(mean), std::cos(0.35)) << s.site;
    EXPECT_NEAR(s.normal.norm(), 1, 1e-12);
  }
}

// Compares the variogram of the face's depths. In people it grows roughly with the distance, in a
// smooth field with the square of the distance.
TEST_P(PhantomLikePeople, DepthsAreAsRoughAsThoseOfPeople) {
  const Phantom smooth =
      MakePhantom({.random_seed = static_cast<std::uint64_t>(GetParam()), .rings = 60});
  const auto unlike_mm2 = [](const Phantom& p, std::size_t bin) {
    std::vector<double> depth_mm = p.depth_mm;
    for (std::size_t v = 0; v < depth_mm.size(); ++v) {
      const Vec3& bone = p.skull.points[v];
      const bool of_face = bone.y() < 65 && bone.z() > -110 && bone.z() < 10;
      depth_mm[v] = of_face && depth_mm[v] < 40 ? depth_mm[v] : kNaN;  // beyond, a ray that grazes
    }
    return EmpiricalVariogram(p.skull.points, depth_mm, {}, 5, 60).at(bin).semivariance_mm2;
  };
  EXPECT_LT(unlike_mm2(phantom_, 4), 4 * unlike_mm2(phantom_, 1));  // 23 mm apart, and 8
  EXPECT_GT(unlike_mm2(smooth, 4), 5 * unlike_mm2(smooth, 1));
  EXPECT_GT(unlike_mm2(phantom_, 4), 5 * unlike_mm2(smooth, 4));
  EXPECT_GT(unlike_mm2(phantom_, 1), 1.5);
  EXPECT_LT(unlike_mm2(phantom_, 1), 25);
}

TEST(PhantomLikePeopleOfASeed, HasTheSameBytesAndDiffersForOtherSeeds) {
  const std::vector<std::uint8_t> bytes = Bytes(MakePhantom(LikePeople(7, 30)));
  EXPECT_EQ(bytes, Bytes(MakePhantom(LikePeople(7, 30))));
  EXPECT_NE(bytes, Bytes(MakePhantom(LikePeople(8, 30))));
}

constexpr RoughnessOptions kField{.sd = 3, .length_mm = 20, .shortest_mm = 4, .radius_mm = 90};

// The mean over many fields of the product of the values at two directions apart_mm apart.
double Covariance(double apart_mm, const RoughnessOptions& options) {
  constexpr int kFields = 200, kPairs = 20;
  Random random(1);
  double sum = 0;
  for (int i = 0; i < kFields; ++i) {
    const WaveSum field = DrawRoughness(options, random);
    for (int k = 0; k < kPairs; ++k) {
      const Vec3 a = random.Direction(), aside = a.unitOrthogonal();
      sum += field.Value(a) * field.Value(a + apart_mm / options.radius_mm * aside);
    }
  }
  return sum / (kFields * kPairs);
}

TEST(Roughness, HasTheExponentialCovariance) {
  for (const double apart_mm : {0.0, 5.0, 10.0, 20.0, 40.0}) {
    EXPECT_NEAR(Covariance(apart_mm, kField), 9 * std::exp(-apart_mm / 20), 0.7) << apart_mm;
  }
}

TEST(Roughness, HasNoWaveShorterThanTheLimit) {
  Random random(2);
  for (const WaveSum::Wave& w : DrawRoughness(kField, random).waves) {
    EXPECT_LE(w.wave_number.norm() / kField.radius_mm, 2 * std::acos(-1) / kField.shortest_mm);
  }
}

TEST(PhantomRelief, LeavesTwoMillimetresAndThickensWithTheSmoothTissue) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    Random random(seed);
    const PhantomRelief relief(random);
    EXPECT_GT(relief.Weight(), 0.7);
    EXPECT_LT(relief.Weight(), 1.3);
    for (int i = 0; i < 1000; ++i) {
      const Vec3 direction = random.Direction();
      EXPECT_GT(relief.Thickness(direction, 0.01), 2);
      EXPECT_LT(relief.Thickness(direction, 5), relief.Thickness(direction, 8));
    }
  }
}

TEST(PhantomRelief, TissueIsThickBesideTheTeethAndThinOverTheNasalBones) {
  double hollow_mm = 0, ridge_mm = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const PhantomRelief relief(random);
    hollow_mm += relief.Thickness(PhantomDirection({37, 28, -62}), 10) / 20;
    ridge_mm += relief.Thickness(PhantomDirection({0, -10, -21}), 10) / 20;
  }
  EXPECT_GT(hollow_mm, 18);
  EXPECT_LT(ridge_mm, 10);
}

}  // namespace

}  // namespace semblance::problems
