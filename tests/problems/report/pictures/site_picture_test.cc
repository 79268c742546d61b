// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/pictures/site_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "problems/subject/propose/mean_skull.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using testing::WordsOf;

bool IsRed(const Image& image, int x, int y) {
  const std::size_t k = 3 * (static_cast<std::size_t>(y) * image.width + x);
  return image.rgb[k] == 0xb3 && image.rgb[k + 1] == 0x26 && image.rgb[k + 2] == 0x1e;
}

// The red pixels of the columns [begin, end): how many, and their middle.
struct Red {
  int count = 0;
  double x = 0, y = 0;
};
Red RedIn(const Image& image, int begin, int end) {
  Red red;
  for (int y = 0; y < image.height; ++y) {
    for (int x = begin; x < end; ++x) {
      if (IsRed(image, x, y)) {
        ++red.count;
        red.x += x;
        red.y += y;
      }
    }
  }
  return {red.count, red.x / red.count, red.y / red.count};
}

TEST(SitePicture, ShowsNumberedMarksOnBone) {
  const std::string picture = SitePictureSvg(2);
  const auto count = [&](const std::string& part) {
    int found = 0;
    for (std::size_t at = picture.find(part); at != picture.npos; at = picture.find(part, at + 1)) {
      ++found;
    }
    return found;
  };
  EXPECT_EQ(count("<image "), 2);
  EXPECT_EQ(count("<circle "), 32 + 21);    // in front, at the side
  EXPECT_EQ(count("<text "), 32 + 21 + 2);  // and a caption each
  EXPECT_EQ(picture, SitePictureSvg(1));
}

class OneSite : public ::testing::Test {
 protected:
  static const SiteSketch& Sketch() {
    static const SiteSketch kSketch = MakeSiteSketch(2);
    return kSketch;
  }
};

TEST_F(OneSite, IsMarkedOnBothPicturesAtOneHeight) {
  for (const auto* const list : {&StandardSites(), &FurtherSites()}) {
    for (const Site& site : *list) {
      const Image image = DrawSitePicture(Sketch(), site.code);
      ASSERT_EQ(image.width, 440);
      ASSERT_EQ(image.height, 260);
      const Red front = RedIn(image, 0, 220), side = RedIn(image, 220, 440);
      EXPECT_GT(front.count, 100) << site.code;
      EXPECT_GT(side.count, 100) << site.code;
      EXPECT_NEAR(front.y, side.y, 6) << site.code;
    }
  }
}

// The subject's left is on the right of a face that looks at the reader; a midline is in the
// middle.
TEST_F(OneSite, IsOnItsSideAndItsMirrorOnTheOther) {
  for (const Site& site : StandardSites()) {
    const double x = RedIn(DrawSitePicture(Sketch(), site.code), 0, 220).x - 109.5;
    const double mirror = RedIn(DrawSitePicture(Sketch(), site.mirror), 0, 220).x - 109.5;
    EXPECT_NEAR(x, -mirror, 6) << site.code;
    if (site.side != Side::kMidline) {
      EXPECT_GT(site.side == Side::kLeft ? x : -x, 15) << site.code;
    }
  }
}

TEST_F(OneSite, FurtherOnesLieOnBoneWhereTheirDefinitionSays) {
  const MeshQuery bone(ReadMeanSkull().head.shell.mesh);
  const auto& places = Sketch().places;
  for (const Site& site : FurtherSites()) {
    if (site.code != "v" && site.code != "op") {  // the mean skull ends before them
      EXPECT_LT(bone.Closest(places.at(site.code)).distance_mm, 1e-6) << site.code;
    }
  }
  const auto z = [&](const char* site) { return places.at(site).z(); };
  EXPECT_GT(z("n"), z("mn"));
  EXPECT_GT(z("mn"), z("rhi"));
  EXPECT_GT(z("rhi"), z("ss"));
  EXPECT_GT(z("ss"), z("mp"));
  EXPECT_GT(z("pg"), z("gn"));
  EXPECT_GT(z("gn"), z("me"));
  for (const auto& [site, place] : places) {
    EXPECT_LE(place.z(), z("v") + 1) << site;
    EXPECT_LE((place - places.at("g")).norm(), (places.at("op") - places.at("g")).norm() + 1);
  }
}

TEST_F(OneSite, AnUnknownOneIsRefusedInWords) {
  EXPECT_THAT(WordsOf<InputError>([] { DrawSitePicture(Sketch(), "gonion"); }),
              HasSubstr("unknown site 'gonion'"));
  EXPECT_THAT(WordsOf<InputError>([] { DrawSitePicture(Sketch(), "go"); }), HasSubstr("go_l"));
}

}  // namespace
}  // namespace semblance::problems
