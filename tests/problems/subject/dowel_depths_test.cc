// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/dowel_depths.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "problems/config/config.h"
#include "problems/subject/dowel_placement.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::WordsOf;

constexpr char kTables[] = SEMBLANCE_SOURCE_DIR "/configs/tables/";

TissueOptions FromTable(const std::string& id, Sex sex, Build build) {
  TissueOptions options;
  options.table = kTables + id + ".yaml";
  options.sex = sex;
  options.build = build;
  return options;
}

TissueOptions Measured() {
  TissueOptions options;
  options.depths = DepthSource::kMeasured;
  return options;
}

// Landmarks with measured depths along the normal 1, 2, ... mm, and their dowels.
struct Subject {
  LandmarkFile file;
  std::vector<Dowel> dowels;
  explicit Subject(const std::vector<std::string>& sites) {
    for (const std::string& site : sites) {
      Landmark& landmark = file.landmarks.emplace_back();
      landmark.site = site;
      landmark.depth_along_normal_mm = file.landmarks.size();
      dowels.emplace_back().site = site;
    }
  }
  std::vector<double> Depths() const {
    std::vector<double> depths;
    for (const Dowel& dowel : dowels) {
      depths.push_back(dowel.depth_mm);
    }
    return depths;
  }
};

TEST(TissueOptions, AreReadFromAConfiguration) {
  const auto options = ReadConfigText<TissueOptions>(
      "depths: table\ntable: t/a.yaml\nsex: female\nbuild: obese\nset_mm: {me: 7, go_l: 12.5}\n",
      "/study/run.yaml");
  EXPECT_EQ(options.table, "/study/t/a.yaml");
  EXPECT_EQ(options.sex, Sex::kFemale);
  EXPECT_EQ(options.build, Build::kObese);
  EXPECT_THAT(options.set_mm, ElementsAre(std::pair("go_l", 12.5), std::pair("me", 7.0)));
  EXPECT_THROW(ReadConfigText<TissueOptions>("set_mm: {me: 0}\n", "x.yaml"), ConfigError);
  EXPECT_THAT(OptionsReference<TissueOptions>(), HasSubstr("set_mm"));
  const auto place = ReadConfigText<PlaceOptions>("{max_distance_mm: 4}", "x.yaml");
  EXPECT_EQ(place.max_distance_mm, 4);
  EXPECT_EQ(place.normal_radius_mm, 3);
}

TEST(FillDepths, UsesTheTablesCellsForBothSides) {
  Subject s({"sg", "go_l", "go_r"});
  EXPECT_THAT(
      FillDepths(FromTable("rhine_caucasoid", Sex::kFemale, Build::kObese), s.file, s.dowels),
      IsEmpty());
  EXPECT_THAT(s.Depths(), ElementsAre(4.25, 17.5, 17.5));
  EXPECT_TRUE(std::isnan(s.dowels[0].sd_mm));
}

TEST(FillDepths, UsesTheDeviationIfTheTableHasOne) {
  Subject s({"g", "go_l"});
  FillDepths(FromTable("t_table_2023", Sex::kMale, Build::kNormal), s.file, s.dowels);
  EXPECT_THAT(s.Depths(), ElementsAre(5.5, 12.5));
  EXPECT_EQ(s.dowels[1].sd_mm, 6);
}

TEST(FillDepths, AddsDeviationsIfTheTableHasThem) {
  Subject s({"g", "go_l"});
  TissueOptions options = FromTable("t_table_2023", Sex::kMale, Build::kNormal);
  options.sds = -1;
  EXPECT_THAT(FillDepths(options, s.file, s.dowels), IsEmpty());
  EXPECT_THAT(s.Depths(), ElementsAre(4.5, 6.5));
  options = FromTable("rhine_caucasoid", Sex::kFemale, Build::kObese);
  options.sds = 1;
  EXPECT_THAT(FillDepths(options, s.file, s.dowels),
              ElementsAre(HasSubstr("has no standard deviation for g, go_l")));
  EXPECT_THAT(s.Depths()[1], 17.5);
}

TEST(FillDepths, NotesThatASuspectCellIsUsed) {
  Subject s({"n", "g"});
  EXPECT_THAT(
      FillDepths(FromTable("rhine_sw_indian", Sex::kMale, Build::kNormal), s.file, s.dowels),
      ElementsAre("site n (Nasion): the depth of 6.86 mm in table 'rhine_sw_indian' is suspect: "
                  "footnote 1 of table A.3: may be a typographical error within the original "
                  "data",
                  "tissue table 'rhine_sw_indian': depth does not grow from emaciated to obese at "
                  "n; `semblance check` shows the rows"));
  EXPECT_EQ(s.dowels[0].depth_mm, 6.86);
}

// Among the rows used, sM2 is out of order for women, n for both sexes, and go for neither.
TEST(FillDepths, NotesUsedRowsThatDoNotGrowWithTheBuild) {
  Subject s({"n", "sM2_l", "sM2_r", "go_l"});
  TissueOptions options = FromTable("rhine_black", Sex::kFemale, Build::kNormal);
  EXPECT_THAT(FillDepths(options, s.file, s.dowels), ElementsAre(HasSubstr("to obese at n, sM2;")));
  options.sex = Sex::kMale;
  EXPECT_THAT(FillDepths(options, s.file, s.dowels), ElementsAre(HasSubstr("to obese at n;")));
  options.set_mm = {{"n", 5}};
  EXPECT_THAT(FillDepths(options, s.file, s.dowels), ElementsAre(HasSubstr("set to 5 mm by hand")));
}

TEST(FillDepths, ASiteThatTheTableLacksIsLeftOutUnlessSet) {
  Subject s({"g", "iM2_l", "iM2_r"});
  TissueOptions options = FromTable("rhine_caucasoid", Sex::kMale, Build::kEmaciated);
  EXPECT_THAT(FillDepths(options, s.file, s.dowels),
              ElementsAre(AllOf(HasSubstr("iM2_l (Sub M2): no depth"), HasSubstr("missing:"),
                                HasSubstr("dowel left out")),
                          HasSubstr("iM2_r (Sub M2): no depth")));
  EXPECT_THAT(s.Depths(), ElementsAre(2.5));
  Subject set({"g", "iM2_l", "iM2_r"});
  options.set_mm = {{"iM2", 10}};
  FillDepths(options, set.file, set.dowels);
  EXPECT_THAT(set.Depths(), ElementsAre(2.5, 10, 10));
}

TEST(FillDepths, ASecondTableFillsOnlyWhatTheFirstLacks) {
  Subject s({"g", "sg", "fe_l", "go_l"});
  TissueOptions options = FromTable("t_table_2023", Sex::kMale, Build::kNormal);
  options.fill_from = kTables + std::string("rhine_caucasoid.yaml");
  EXPECT_THAT(FillDepths(options, s.file, s.dowels),
              ElementsAre("tissue table 't_table_2023' has no depth for sg, fe_l: taken from "
                          "'rhine_caucasoid'"));
  EXPECT_THAT(s.Depths(), ElementsAre(5.5, 4.25, 4.25, 12.5));
  EXPECT_TRUE(std::isnan(s.dowels[1].sd_mm));
  EXPECT_EQ(s.dowels[3].sd_mm, 6);
  EXPECT_THAT(TissueTableFiles(options), ElementsAre(options.table, options.fill_from));
}

TEST(FillDepths, ADepthOfOneSidePrecedesThatOfThePair) {
  Subject s({"go_l", "go_r", "g"});
  TissueOptions options = Measured();
  options.set_mm = {{"go", 12}, {"go_l", 14}, {"me", 7}};
  EXPECT_THAT(FillDepths(options, s.file, s.dowels),
              ElementsAre("site go_l (Gonion): depth set to 14 mm by hand",
                          "site go_r (Gonion): depth set to 12 mm by hand",
                          "set_mm: no dowel uses the depth of site me (Beneath Chin)"));
  EXPECT_THAT(s.Depths(), ElementsAre(14, 12, 3));
}

// One pass over both lists equals a pass over each, in depths and in the notes about the used
// dowels.
TEST(FillDepths, FillsAllAndUsedDowelsAtOnce) {
  TissueOptions options = FromTable("t_table_2023", Sex::kMale, Build::kNormal);
  options.fill_from = kTables + std::string("rhine_caucasoid.yaml");
  options.sds = 1;
  options.set_mm = {{"me", 7}, {"go", 12}};
  Subject all({"g", "sg", "me", "fe_l", "go_l", "zy_l", "mmb_l"}), used({"sg", "go_l", "zy_l"});
  Subject all_alone = all, used_alone = used;
  FillDepths(options, all.file, all_alone.dowels);
  const std::vector<std::string> notes = FillDepths(options, all.file, used_alone.dowels);
  EXPECT_EQ(FillDepths(options, all.file, all.dowels, used.dowels), notes);
  EXPECT_EQ(all.Depths(), all_alone.Depths());
  EXPECT_EQ(used.Depths(), used_alone.Depths());
}

TEST(FillDepths, RefusesToSetAnUnknownSiteOrNoDepth) {
  Subject s({"g"});
  TissueOptions options = Measured();
  options.set_mm = {{"go_ll", 12}};
  EXPECT_EQ(WordsOf<InputError>([&] { FillDepths(options, s.file, s.dowels); }),
            "set_mm: unknown site 'go_ll'; did you mean 'go_l'?");
  options.set_mm = {{"g", 0}};
  EXPECT_EQ(WordsOf<InputError>([&] { FillDepths(options, s.file, s.dowels); }),
            "set_mm: the depth of site g (Glabella) is 0 mm; it must be above 0");
}

TEST(FillDepths, NeedsATable) {
  Subject s({"g"});
  EXPECT_EQ(WordsOf<InputError>([&] { FillDepths({}, s.file, s.dowels); }),
            "tissue depths come from a table, but no table is named; set `table` to a file such as "
            "configs/tables/rhine_caucasoid.yaml, or `depths: measured`");
}

TEST(FillDepths, MeasuredFallsBackToTheClosestSkinAndDropsTheRest) {
  Subject s({"sg", "go_l", "me"});
  s.file.landmarks[1].depth_along_normal_mm.reset();
  s.file.landmarks[1].depth_closest_mm = 11.25;
  s.file.landmarks[2].depth_along_normal_mm.reset();
  EXPECT_THAT(
      FillDepths(Measured(), s.file, s.dowels),
      ElementsAre("site go_l (Gonion): no depth along the normal; 11.25 mm to the closest skin "
                  "used instead",
                  "site me (Beneath Chin): no measured depth; dowel dropped"));
  EXPECT_THAT(s.Depths(), ElementsAre(1, 11.25));
  EXPECT_EQ(s.dowels[1].site, "go_l");
}

TEST(FillDepths, NoDepthAtAllIsAnError) {
  Subject s({"me"});
  s.file.landmarks[0].depth_along_normal_mm.reset();
  EXPECT_THAT(WordsOf<InputError>([&] { FillDepths(Measured(), s.file, s.dowels); }),
              HasSubstr("measure at least one in the landmark file"));
}

// A skull of 50 mm within a skin of 60 mm, and a dowel on it at the angle `off_deg` from the skin's
// direction.
struct Ball {
  TriMesh skull = testing::SphereMesh({0, 0, 0}, 50, 60),
          skin = testing::SphereMesh({0, 0, 0}, 60, 60);
  MeshQuery bone{skull};
  LandmarkFile file;
  std::vector<Dowel> dowels;

  void Add(const std::string& site, double off_deg, std::optional<double> closest_mm,
           std::optional<double> normal_mm = {}) {
    Landmark& landmark = file.landmarks.emplace_back();
    landmark.site = site;
    landmark.depth_closest_mm = closest_mm;
    landmark.depth_along_normal_mm = normal_mm;
    const double angle = off_deg * std::numbers::pi / 180;
    Dowel& dowel = dowels.emplace_back();
    dowel.site = site;
    dowel.base = {0, 0, 50};
    dowel.direction = {std::sin(angle), 0, std::cos(angle)};
    dowel.depth_mm = normal_mm ? *normal_mm : *closest_mm;
  }
  std::vector<std::string> Turn(bool with_skin) {
    std::vector<Dowel> all = dowels;
    const std::vector<std::string> notes = TurnToSkin(
        {.landmarks = file, .skin = with_skin ? &skin : nullptr, .bone = skull, .skull = bone}, all,
        dowels);
    EXPECT_EQ(all.size(), dowels.size());
    return notes;
  }
};

TEST(TurnToSkin, ADepthToTheClosestSkinIsLaidTowardsIt) {
  Ball ball;
  ball.Add("g", 70, 10.0);
  ball.Add("n", 150, 10.0);
  ball.Add("rhi", 70, 10.0, 25.0);  // measured along its normal: right as it is
  const std::vector<std::string> notes = ball.Turn(true);
  ASSERT_EQ(ball.dowels.size(), 3U);
  EXPECT_LT((ball.dowels[0].Tip() - Vec3(0, 0, 60)).norm(), 0.3);
  EXPECT_LT((ball.dowels[1].Tip() - Vec3(0, 0, 60)).norm(), 0.3);
  EXPECT_NEAR(ball.dowels[2].direction.z(), std::cos(70 * std::numbers::pi / 180), 1e-12);
  EXPECT_THAT(notes,
              ElementsAre(AllOf(HasSubstr("site g"), HasSubstr("9 degrees from the normal")),
                          AllOf(HasSubstr("site n"), HasSubstr("9 degrees from the normal"))));
}

TEST(TurnToSkin, DropsADowelWhoseSkinIsElsewhere) {
  Ball ball;
  ball.Add("g", 10, 10.0);
  ball.Add("n", 10, 18.0);
  EXPECT_THAT(ball.Turn(true), ::testing::Contains(AllOf(HasSubstr("site n"), HasSubstr("18.00 mm"),
                                                         HasSubstr("dropped"))));
  ASSERT_EQ(ball.dowels.size(), 1U);
  EXPECT_EQ(ball.dowels[0].site, "g");
}

TEST(TurnToSkin, WithoutASkinDropsADowelThatEntersBone) {
  Ball ball;
  ball.Add("g", 40, 10.0);
  ball.Add("n", 150, 10.0);
  EXPECT_THAT(ball.Turn(false), ElementsAre(AllOf(HasSubstr("site n"), HasSubstr("into the skull"),
                                                  HasSubstr("dropped"))));
  ASSERT_EQ(ball.dowels.size(), 1U);
  EXPECT_EQ(ball.dowels[0].site, "g");
  EXPECT_NEAR(ball.dowels[0].direction.z(), std::cos(40 * std::numbers::pi / 180), 1e-12);
}

}  // namespace
}  // namespace semblance::problems
