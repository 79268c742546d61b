// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/mandible.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "problems/config/config.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "problems/subject/landmarks.h"
#include "problems/subject/sites.h"
#include "surfaces/base/random.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

// An average skull in another pose and size, with noise_mm of noise on its sites and an open jaw.
std::vector<SitePoint> Skull(double opening_deg, double noise_mm, std::uint64_t random_seed = 1) {
  const Vec3 hinge = (AverageCondyles()[0] + AverageCondyles()[1]) / 2;
  const Mat3 turn =
      Eigen::AngleAxisd(opening_deg * std::numbers::pi / 180, Vec3::UnitX()).toRotationMatrix();
  const Similarity pose{
      0.93, Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()).toRotationMatrix(), {10, 20, 30}};
  Random random(random_seed);
  std::vector<SitePoint> sites;
  for (const std::string& code : StandardSiteCodes()) {
    const Vec3 closed = AverageSite(code);
    const Vec3 open = IsOfMandible(code) ? Vec3(hinge + turn * (closed - hinge)) : closed;
    sites.push_back({code, pose * (open + random.InBox(-noise_mm, noise_mm))});
  }
  return sites;
}

TEST(JawPose, IsTheHingesAngle) {
  for (const double opening_deg : {-5.0, 0.0, 10.0, 30.0}) {
    EXPECT_NEAR(FindJawPose(Skull(opening_deg, 0))->opening_deg, opening_deg, 1e-6);
  }
  EXPECT_NEAR(FindJawPose(Skull(0, 0))->off_mm, 0, 1e-6);
}

TEST(JawPose, ToleratesNoiseAndAWrongSite) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    std::vector<SitePoint> sites = Skull(20, 4, seed);
    std::ranges::find(sites, "go_l", &SitePoint::site)->point += Vec3(0, 40, 30);
    EXPECT_NEAR(FindJawPose(sites)->opening_deg, 20, 6) << seed;
  }
}

TEST(JawPose, OfRealHeadsThatBiteIsSmall) {
  for (const char* name : {"cthead", "vhm"}) {
    std::vector<SitePoint> sites;
    for (const Landmark& l :
         ReadLandmarks(std::string(SEMBLANCE_SOURCE_DIR "/configs/landmarks/") + name + ".yaml")
             .file.landmarks) {
      sites.push_back({l.site, Vec3(l.point.data())});
    }
    EXPECT_LT(std::abs(FindJawPose(sites)->opening_deg), 10) << name;
  }
}

TEST(JawPose, NeedsSitesOfBothJaws) {
  std::vector<SitePoint> sites = Skull(0, 0);
  std::erase_if(sites, [](const SitePoint& s) { return IsOfMandible(s.site); });
  EXPECT_FALSE(FindJawPose(sites));
}

TEST(JawPose, TheCondylesMirrorEachOtherBehindTheFace) {
  const auto [left, right] = AverageCondyles();
  EXPECT_GT(left.x(), 40);
  EXPECT_EQ(left, Vec3(-right.x(), right.y(), right.z()));
}

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::WordsOf;

const Hinge kHinge{{50, 76, -38}, {-48, 75, -40}};

LandmarkFile AverageLandmarks() {
  LandmarkFile file;
  for (const std::string& code : StandardSiteCodes()) {
    Landmark& landmark = file.landmarks.emplace_back();
    const Vec3 p = AverageSite(code);
    landmark.site = code;
    landmark.point = {p.x(), p.y(), p.z()};
    landmark.normal = {0, -1, 0};
  }
  return file;
}

Landmark& At(LandmarkFile& file, const std::string& site) {
  return *std::ranges::find(file.landmarks, site, &Landmark::site);
}

Vec3 PointAt(LandmarkFile& file, const std::string& site) {
  return Vec3(At(file, site).point.data());
}

TEST(Hinge, ZeroIsTheExactIdentity) {
  const Vec3 p(1.1, -2.3, -99.7);
  EXPECT_EQ(kHinge.Opened(p, 0), p);
}

TEST(Hinge, OpeningAndClosingIsTheIdentityAndTheAxisStays) {
  for (const double opening_deg : {-20.0, 3.0, 45.0}) {
    for (const Vec3& p : {Vec3(0, 10, -112), Vec3(48, 71, -89), Vec3(-30, 38, -89)}) {
      EXPECT_LT((kHinge.Opened(kHinge.Opened(p, opening_deg), -opening_deg) - p).norm(), 1e-12);
      EXPECT_NEAR((kHinge.Opened(p, opening_deg) - kHinge.left).norm(), (p - kHinge.left).norm(),
                  1e-12);
    }
    EXPECT_LT((kHinge.Opened(kHinge.right, opening_deg) - kHinge.right).norm(), 1e-12);
  }
}

TEST(Hinge, OpeningLowersTheChin) {
  const Vec3 chin(0, 10, -112);
  const Vec3 open = kHinge.Opened(chin, 20);
  EXPECT_LT(open.z(), chin.z() - 10);
  EXPECT_GT(open.y(), chin.y());
}

TEST(Hinge, ABiteIsTheRequestedDistance) {
  const Vec3 pr(0.5, -1, -67), id(-0.5, 4, -91);
  for (const double bite_mm : {15.0, 24.5, 40.0, 60.0}) {
    const double opening_deg = OpeningForBite_deg(kHinge, pr, id, bite_mm);
    EXPECT_NEAR((kHinge.Opened(id, opening_deg) - pr).norm(), bite_mm, 1e-9);
    EXPECT_EQ(opening_deg > 0, bite_mm > (pr - id).norm());
    EXPECT_LT(std::abs(opening_deg), 60);
  }
  EXPECT_THAT(WordsOf<InputError>([&] { OpeningForBite_deg(kHinge, pr, id, 900); }),
              HasSubstr("cannot be 900 mm apart"));
}

TEST(AddMandible, TurnsOnlyTheMandibleAndItsLandmarks) {
  LandmarkFile file = AverageLandmarks(), before = file;
  const TriMesh cranium = testing::SphereMesh({0, 60, 30}, 80, 6);
  const TriMesh jaw = testing::SphereMesh({0, 20, -100}, 30, 6);
  TriMesh skull = cranium;
  MandibleOptions options;
  options.opening_deg = 12;
  const auto notes = AddMandible(options, jaw, skull, file);
  EXPECT_THAT(notes, ElementsAre(HasSubstr("opened by 12.0 degrees about the condyles")));
  ASSERT_EQ(skull.points.size(), cranium.points.size() + jaw.points.size());
  EXPECT_TRUE(std::equal(cranium.points.begin(), cranium.points.end(), skull.points.begin()));
  EXPECT_NE(skull.points.back(), jaw.points.back());
  std::vector<SitePoint> sites;
  for (const Landmark& l : file.landmarks) {
    EXPECT_EQ(l.point == At(before, l.site).point, !IsOfMandible(l.site)) << l.site;
    EXPECT_NEAR(Vec3(l.normal->data()).norm(), 1, 1e-12);
    sites.push_back({l.site, Vec3(l.point.data())});
  }
  EXPECT_NEAR(FindJawPose(sites)->opening_deg, 12, 1e-6);
  options.opening_deg = -12;
  TriMesh again;
  AddMandible(options, {}, again, file);
  for (const Landmark& l : file.landmarks) {
    EXPECT_LT((Vec3(l.point.data()) - PointAt(before, l.site)).norm(), 1e-6) << l.site;
  }
}

TEST(AddMandible, WithoutAnAngleItOnlyAdds) {
  LandmarkFile file = AverageLandmarks(), before = file;
  const TriMesh jaw = testing::SphereMesh({0, 20, -100}, 30, 6);
  TriMesh skull;
  MandibleOptions options;
  options.opening_deg = 0;
  EXPECT_THAT(AddMandible(options, jaw, skull, file), IsEmpty());
  EXPECT_EQ(skull.points, jaw.points);
  EXPECT_EQ(PointAt(file, "me"), PointAt(before, "me"));
}

TEST(MandibleOptions, ContradictionsAreReportedAtTheirLine) {
  const auto words = [](const std::string& text) {
    return WordsOf<ConfigError>([&] { ReadConfigText<MandibleOptions>(text, "a.yaml"); });
  };
  EXPECT_THAT(words("{mesh: a.ply, opening_deg: 3, bite_mm: 30}"), HasSubstr("given twice"));
  EXPECT_THAT(words("{mesh: a.ply, condyle_left: [1, 2, 3]}"), HasSubstr("needs both condyles"));
  EXPECT_THAT(words("{opening_deg: 3}"), HasSubstr("there is no mesh to turn"));
  EXPECT_THAT(words("{mesh: a.ply, opening_deg: 90}"), HasSubstr("opening_deg"));
}

TEST(MandibleOptions, CondylesAreAnAxisFromRightToLeft) {
  const auto words = [](const std::string& condyles) {
    return WordsOf<ConfigError>([&] {
      ReadConfigText<MandibleOptions>("{mesh: a.ply, opening_deg: -10, " + condyles + "}",
                                      "a.yaml");
    });
  };
  EXPECT_THAT(words("condyle_left: [-48, 75, -40], condyle_right: [50, 76, -38]"),
              AllOf(HasSubstr("condyle_left"), HasSubstr("exchange the two")));
  EXPECT_THAT(words("condyle_left: [50, 76, -38], condyle_right: [50, 76, -38]"),
              HasSubstr("0.0 mm apart"));
  EXPECT_THAT(words("condyle_left: [5.0, 7.6, -3.8], condyle_right: [-4.8, 7.5, -4.0]"),
              HasSubstr("at least 40 mm"));
  const auto options = ReadConfigText<MandibleOptions>(
      "{mesh: a.ply, condyle_left: [50, 76, -38], condyle_right: [-48, 75, -40]}", "a.yaml");
  EXPECT_EQ(FindHinge(options, {}).left, kHinge.left);
}

TEST(Hinge, UncheckedCondylesAreRefusedToo) {
  MandibleOptions options;
  options.condyle_left = options.condyle_right = {50, 76, -38};
  EXPECT_THAT(WordsOf<InputError>([&] { FindHinge(options, {}); }),
              HasSubstr("subject.mandible.condyle_left: the condyles are 0.0 mm apart"));
}

}  // namespace

}  // namespace semblance::problems
