// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/mirror.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "problems/subject/phantom.h"
#include "problems/subject/sites.h"
#include "surfaces/base/random.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::WordsOf;

std::vector<SitePoint> SitesOf(const Phantom& phantom) {
  std::vector<SitePoint> sites;
  for (const PhantomSite& s : phantom.sites) {
    sites.push_back({s.site, s.base});
  }
  return sites;
}

LandmarkFile FileOf(const Phantom& phantom) {
  LandmarkFile file;
  for (const PhantomSite& s : phantom.sites) {
    Landmark& landmark = file.landmarks.emplace_back();
    landmark.site = s.site;
    landmark.point = {s.base.x(), s.base.y(), s.base.z()};
  }
  return file;
}

// The skull without the bone within 35 mm of the left cheek.
TriMesh WithoutCheek(const Phantom& phantom) {
  const Vec3 cheek =
      std::ranges::find(phantom.sites, std::string("im_l"), &PhantomSite::site)->base;
  std::vector<bool> keep;
  for (const Triangle& t : phantom.skull.triangles) {
    keep.push_back((TriangleCentroid(phantom.skull, t) - cheek).norm() > 35);
  }
  return Submesh(phantom.skull, keep);
}

TEST(FitMidPlane, FindsThePlaneOfAMirroredSet) {
  const Vec3 normal = Vec3(0.9, 0.3, -0.1).normalized();
  const MidPlane truth{.normal = normal, .offset_mm = 17};
  Random random(1);
  std::vector<SitePoint> sites;
  for (const Site& site : StandardSites()) {
    const Vec3 p = 60 * random.InBox(-1, 1);
    const Vec3 left = p + (std::abs(normal.dot(p) - 17) - (normal.dot(p) - 17) + 5) * normal;
    const Vec3 midline = p - (normal.dot(p) - 17) * normal;
    if (site.side == Side::kMidline) {
      sites.push_back({site.code, midline});
    } else if (site.side == Side::kLeft) {
      sites.push_back({site.code, left});
      sites.push_back({site.mirror, truth.Mirrored(left)});
    }
  }
  const MidPlane found = FitMidPlane(sites);
  EXPECT_LT((found.normal - normal).norm(), 1e-9);
  EXPECT_NEAR(found.offset_mm, 17, 1e-9);
  EXPECT_NEAR(found.rms_mm, 0, 1e-6);
  EXPECT_EQ(found.pairs, 11);
  EXPECT_EQ(found.midline, 10);
}

TEST(FitMidPlane, MinimisesItsSumOfSquares) {
  const std::vector<SitePoint> sites = SitesOf(MakePhantom({.random_seed = 4, .rings = 20}));
  const MidPlane found = FitMidPlane(sites);
  const auto sum = [&](const Vec3& normal, double offset_mm) {
    const MidPlane plane{.normal = normal.normalized(), .offset_mm = offset_mm};
    double total = 0;
    for (const Site& site : StandardSites()) {
      const Vec3 own = std::ranges::find(sites, site.code, &SitePoint::site)->point,
                 other = std::ranges::find(sites, site.mirror, &SitePoint::site)->point;
      total += site.side == Side::kRight ? 0 : (plane.Mirrored(own) - other).squaredNorm();
    }
    return total;
  };
  const double least = sum(found.normal, found.offset_mm);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double step : {-1e-3, 1e-3}) {
      EXPECT_GE(sum(found.normal + step * Vec3::Unit(axis), found.offset_mm), least);
    }
  }
  EXPECT_GT(sum(found.normal, found.offset_mm + 0.01), least);
  EXPECT_GT(sum(found.normal, found.offset_mm - 0.01), least);
}

TEST(FitMidPlane, NeedsSitesThatDetermineThePlane) {
  const std::vector<SitePoint> all = SitesOf(MakePhantom({.rings = 20}));
  EXPECT_THAT(WordsOf<InputError>([&] { FitMidPlane(std::span(all).first(10)); }),
              HasSubstr("0 pairs of sites and 10 in the midline"));
}

TEST(MirrorMissing, ACutCheekIsRestoredFromTheOtherSide) {
  const Phantom phantom = MakePhantom({.random_seed = 2, .rings = 100});
  const TriMesh cut = WithoutCheek(phantom);
  const double gone_cm2 = (Area(phantom.skull) - Area(cut)) / 100;
  ASSERT_GT(gone_cm2, 20);
  const MirroredSkull whole = MirrorMissing(cut, FitMidPlane(SitesOf(phantom)), {}, 2);
  // The observed bone comes first and keeps its exact bits.
  ASSERT_GT(whole.mesh.points.size(), cut.points.size());
  EXPECT_TRUE(std::equal(cut.points.begin(), cut.points.end(), whole.mesh.points.begin()));
  EXPECT_TRUE(std::equal(cut.triangles.begin(), cut.triangles.end(), whole.mesh.triangles.begin()));
  for (std::size_t t = 0; t < whole.origin.size(); ++t) {
    EXPECT_EQ(whole.origin[t] == BoneOrigin::kMirrored, t >= cut.triangles.size());
  }
  // The mirrored bone is as far from the true bone as the head is from its mirror image.
  const MeshQuery query(whole.mesh), truth(phantom.skull);
  double most_mm = 0;
  for (const Vec3& p : phantom.skull.points) {
    most_mm = std::max(most_mm, query.Closest(p).distance_mm);
  }
  EXPECT_LT(most_mm, 4);
  for (std::size_t v = cut.points.size(); v < whole.mesh.points.size(); ++v) {
    EXPECT_LT(truth.Closest(whole.mesh.points[v]).distance_mm, 4);
  }
  EXPECT_NEAR(whole.to_left_cm2, gone_cm2, 0.35 * gone_cm2);
  EXPECT_EQ(whole.to_right_cm2, 0);
  EXPECT_GT(AreaByOrigin_cm2(whole.mesh, whole.origin)[1], 0.6 * gone_cm2);
  EXPECT_GT(SignedVolume(whole.mesh), 0.98 * SignedVolume(phantom.skull));  // faces outward
}

TEST(MirrorMissing, NothingIsAddedToAWholeSkullAndThreadsDoNotMatter) {
  const Phantom phantom = MakePhantom({.random_seed = 2, .rings = 40});
  const MidPlane plane = FitMidPlane(SitesOf(phantom));
  EXPECT_EQ(MirrorMissing(phantom.skull, plane, {}, 1).mesh.points, phantom.skull.points);
  const TriMesh cut = WithoutCheek(phantom);
  const MirroredSkull one = MirrorMissing(cut, plane, {}, 1),
                      four = MirrorMissing(cut, plane, {}, 4);
  EXPECT_EQ(one.mesh.points, four.mesh.points);
  EXPECT_EQ(one.mesh.triangles, four.mesh.triangles);
}

TEST(MirrorMissing, APlaneThatMirrorsNothingIsRefused) {
  const Phantom phantom = MakePhantom({.rings = 30});
  MidPlane plane = FitMidPlane(SitesOf(phantom));
  plane.offset_mm += 90;
  EXPECT_THAT(WordsOf<InputError>([&] { MirrorMissing(phantom.skull, plane, {}, 1); }),
              HasSubstr("does not mirror it"));
}

TEST(PrepareMirrored, NotesInventedBoneAndMirrorsTheLandmarkThere) {
  const Phantom phantom = MakePhantom({.random_seed = 2, .rings = 60});
  TriMesh skull = WithoutCheek(phantom);
  LandmarkFile file = FileOf(phantom);
  std::erase_if(file.landmarks,
                [](const Landmark& l) { return l.site == "im_l" || l.site == "go_l"; });
  file.absent = {{"im_l", "the cheek is gone"}};
  std::vector<BoneOrigin> origin;
  const TriMesh before = skull;
  EXPECT_THAT(PrepareMirrored({}, skull, origin, file, 1), IsEmpty());
  EXPECT_EQ(skull.points, before.points);
  const auto notes = PrepareMirrored({.missing = true}, skull, origin, file, 1);
  EXPECT_THAT(notes, Contains(HasSubstr("cm² of bone that the left side lacks are mirrored")));
  EXPECT_THAT(
      notes,
      Contains(HasSubstr("the points of sites im_l are mirrored with it")));  // go_l: bone is there
  EXPECT_EQ(origin.size(), skull.triangles.size());
  EXPECT_THAT(file.absent, IsEmpty());
  const auto found = std::ranges::find(file.landmarks, std::string("im_l"), &Landmark::site);
  ASSERT_NE(found, file.landmarks.end());
  EXPECT_EQ(found->certainty, Certainty::kLow);
  const Vec3 truth =
      std::ranges::find(phantom.sites, std::string("im_l"), &PhantomSite::site)->base;
  EXPECT_LT((Vec3(found->point.data()) - truth).norm(), 5);
}

TEST(OriginOfShell, BoneFarFromTheSkullIsInferred) {
  const Phantom phantom = MakePhantom({.random_seed = 2, .rings = 40});
  const TriMesh cut = WithoutCheek(phantom);
  const auto origin = OriginOfShell(phantom.skull, cut, {}, 2);
  const auto area_cm2 = AreaByOrigin_cm2(phantom.skull, origin);
  EXPECT_NEAR(area_cm2[0] + area_cm2[1] + area_cm2[2], Area(phantom.skull) / 100, 1e-9);
  EXPECT_EQ(area_cm2[1], 0);
  EXPECT_NEAR(area_cm2[2], (Area(phantom.skull) - Area(cut)) / 100, 8);
  const auto under = OriginUnder(phantom.face, phantom.skull, origin, 2);
  EXPECT_EQ(under.size(), phantom.face.points.size());
  EXPECT_TRUE(std::ranges::count(under, BoneOrigin::kInferred) > 10);
}

}  // namespace
}  // namespace semblance::problems
