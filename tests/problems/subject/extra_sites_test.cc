// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/extra_sites.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/config/config.h"
#include "problems/subject/sites.h"
#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::WordsOf;

struct SitesOption {
  ExtraSites sites;
};
template <class Visitor>
void Fields(Visitor& visit, SitesOption& o) {
  visit(FieldInfo{.name = "sites", .doc = "all"}, o.sites);
}

ExtraSites Read(const std::string& text) {
  return ReadConfigText<SitesOption>("sites: {" + text + "}\n", "a.yaml").sites;
}

std::string Words(const std::string& text) {
  return WordsOf<ConfigError>([&] { Read(text); });
}

TEST(ExtraSites, AreReadAndWrittenBack) {
  const std::string text =
      "a: {near: [1, -2.5, 3], depth: 7.5}, b: {near: go_l, depth: auto}, c: {near: [n, rhi]}, n: "
      "{uv: [0.5, 0.6], hold: true}";
  const ExtraSites sites = Read(text);
  EXPECT_EQ(*ReadPlace(sites.at("a").near).point, Vec3(1, -2.5, 3));
  EXPECT_EQ(sites.at("a").depth->value, 7.5);
  EXPECT_TRUE(sites.at("b").depth->automatic);
  EXPECT_THAT(ReadPlace(sites.at("b").near).landmarks, ElementsAre("go_l"));
  EXPECT_THAT(ReadPlace(sites.at("c").near).landmarks, ElementsAre("n", "rhi"));
  EXPECT_FALSE(sites.at("c").depth);
  EXPECT_TRUE(IsHeld(sites, "n"));
  EXPECT_FALSE(IsHeld(sites, "a") || IsHeld(sites, "g"));
  const std::string written = WriteConfig(SitesOption{sites});
  EXPECT_EQ(WriteConfig(ReadConfigText<SitesOption>(written, "b.yaml")), written);
}

TEST(ExtraSites, AFaultIsOneLine) {
  EXPECT_THAT(Words("a: {near: [1, 2, 3], uv: [0.5, 0.5], depth: 3}"),
              HasSubstr("sites.a.near: the place of the site is given twice"));
  EXPECT_THAT(Words("n: {uv: [0.5, 1.2]}"), HasSubstr("sites.n.uv[1]: "));
  EXPECT_THAT(Words("a: {near: g, depth: -1}"), HasSubstr("sites.a.depth: "));
  EXPECT_THAT(Words("a: {near: gg, depth: 1}"), HasSubstr("sites.a.near: unknown site 'gg'"));
  EXPECT_THAT(Words("a: {near: go, depth: 1}"), HasSubstr("write 'go_l' or 'go_r'"));
  EXPECT_THAT(Words("a: {near: [1, 2], depth: 1}"), HasSubstr("write [x, y, z] in mm"));
  EXPECT_THAT(Words("a: {near: {x: 1}, depth: 1}"), HasSubstr("write [x, y, z] in mm"));
  EXPECT_THAT(Words("a: {near: g, depth: 1}, a: {near: n, depth: 1}"), HasSubstr("sites.a"));
}

TEST(ExtraSites, ANameThatIsNoSiteNeedsAPlace) {
  EXPECT_THAT(
      SiteOptionFaults(Read("n: {uv: [0, 1]}, mine: {near: n, depth: 3}, mmb_l: {near: pg}")),
      IsEmpty());
  const auto fault = [](const std::string& text) {
    const std::vector<OptionFault> faults = SiteOptionFaults(Read(text));
    return faults.size() == 1 ? faults[0].path + ": " + faults[0].what : "";
  };
  EXPECT_THAT(fault("nn: {depth: 3}"),
              AllOf(HasSubstr("nn: unknown site 'nn'"), HasSubstr("needs `near` or `uv`")));
  EXPECT_THAT(fault("go: {uv: [0.5, 0.5]}"), HasSubstr("write 'go_l' or 'go_r'"));
  EXPECT_THAT(fault("n: {}"), HasSubstr("the site has no options"));
}

TEST(PointNear, IsThePointTheLandmarkOrTheMiddleOfSeveral) {
  std::vector<SitePoint> given;
  for (const Site& site : StandardSites()) {
    if (site.code != "go_l") {
      given.push_back({site.code, AverageSite(site.code) + Vec3(5, 6, 7)});
    }
  }
  const auto at = [&](const std::string& near) {
    return PointNear("a", Read("a: {near: " + near + "}").at("a").near, given);
  };
  EXPECT_EQ(at("[1, 2, 3]"), Vec3(1, 2, 3));
  EXPECT_EQ(at("g"), AverageSite("g") + Vec3(5, 6, 7));
  EXPECT_LT((at("[n, rhi]") - Vec3(5, 0.5, 0)).norm(), 1e-9);
  EXPECT_LT((at("go_l") - AverageSite("go_l") - Vec3(5, 6, 7)).norm(), 1e-6);  // predicted
  EXPECT_THAT(WordsOf<InputError>([&] { at("mn"); }),
              HasSubstr("sites.a.near: mn (Mid-nasal) is not among the landmarks"));
}

}  // namespace
}  // namespace semblance::problems
