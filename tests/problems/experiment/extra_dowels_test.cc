// SPDX-License-Identifier: GPL-3.0-or-later
// Dowels in addition to those of the landmarks, on a small phantom.
#include "problems/experiment/extra_dowels.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <numbers>

#include "problems/experiment/dowel_projection.h"
#include "problems/experiment/experiment_config.h"
#include "problems/experiment/skull_stage.h"
#include "problems/run.h"
#include "problems/subject/phantom.h"
#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::WordsOf;

Experiment Phantom30(const std::string& sites, std::vector<std::string> overrides = {}) {
  overrides.insert(overrides.begin(),
                   {"subject.rings=30", "implicit.resolution=24", "template.max_level=2"});
  if (!sites.empty()) {
    overrides.push_back("sites={" + sites + "}");
  }
  return ReadConfig<Experiment>(SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml", overrides);
}

std::shared_ptr<const SkullStage> StageOf(const Experiment& experiment) {
  const RunContext context;
  StageCache cache(4);
  StepClock step(context);
  return MakeSkullStage(experiment, cache, step, context);
}

Case CaseOf(const Experiment& experiment) {
  return MakeCase(LoadSubject(experiment.subject, {}), experiment, {});
}

const Dowel& At(const std::vector<Dowel>& dowels, const std::string& site) {
  return *std::ranges::find(dowels, site, &Dowel::site);
}

// The middle of the left cheek of the phantom, inside the network.
constexpr char kCheek[] = "near: [im_l, lo_l]";

TEST(ExtraDowels, AnInterpolatedDepthHasTheDeviationOfItsPlace) {
  const auto stage =
      StageOf(Phantom30(fmt::format("mine: {{{}, depth: auto}}", kCheek), {"interp=kriging"}));
  const DepthStage& depths = *stage->depth_stage;
  const Dowel& open = At(depths.subject.dowels_on_bone, "mine");
  const Triangle& t = depths.shell.triangles[MeshQuery(depths.shell).Closest(open.base).triangle];
  const auto [least, most] =
      std::minmax({depths.depth.sd_mm[t[0]], depths.depth.sd_mm[t[1]], depths.depth.sd_mm[t[2]]});
  EXPECT_GT(least, 0);
  EXPECT_GE(open.sd_mm, least);
  EXPECT_LE(open.sd_mm, most);
}

TEST(ExtraDowels, NoneIsCarriedOntoAPhantomAndANoteStatesIt) {
  const Case usual = CaseOf(Phantom30("")),
             carried = CaseOf(Phantom30("", {"landmarks.carried=people"}));
  EXPECT_EQ(carried.dowels_on_bone.size(), usual.dowels_on_bone.size());
  EXPECT_TRUE(carried.open_dowels.empty());
  EXPECT_THAT(carried.notes, Contains(HasSubstr("no dowel is added: a phantom's skull")));
  EXPECT_THAT(usual.notes, Not(Contains(HasSubstr("landmarks.carried"))));
}

TEST(ExtraDowels, TheInterpolatedDepthChangesNoOtherDowel) {
  const auto before = StageOf(Phantom30(fmt::format("mine: {{{}, depth: auto}}", kCheek)));
  const Dowel& open = At(before->depth_stage->subject.dowels_on_bone, "mine");
  const auto after =
      StageOf(Phantom30(fmt::format("mine: {{{}, depth: {}}}", kCheek, open.depth_mm)));
  const DepthStage &was = *before->depth_stage, &is = *after->depth_stage;
  ASSERT_EQ(was.shell.points.size(), is.shell.points.size());
  const MeshQuery query(was.shell);
  int seen = 0;
  for (const Dowel& dowel : was.subject.dowels_on_bone) {
    const Triangle& t = was.shell.triangles[query.Closest(dowel.base).triangle];
    for (const auto v : t) {
      // In the network, beyond the area that was split.
      if (was.depth.status[v] == DepthStatus::kAssigned &&
          (was.shell.points[v] - open.base).norm() > 25) {
        EXPECT_NEAR(was.depth.depth_mm[v], is.depth.depth_mm[v], 1e-6) << dowel.site;
        ++seen;
      }
    }
    EXPECT_EQ(dowel.depth_mm, At(is.subject.dowels_on_bone, dowel.site).depth_mm);
  }
  EXPECT_GT(seen, 40);
  EXPECT_EQ(was.subject.network.areas.size() + 2, is.subject.network.areas.size());
}

// The depth in the middle of the cheek is 4 mm more than interpolated. The implicit face comes out
// to the tip within 2.0 mm: the emitters round off a cone of depths that is no broader than their
// reach.
TEST(ExtraDowels, PullTheImplicitFaceToTheirTips) {
  constexpr char kMiddle[] = "near: [zy_l, mr_l, sM2_l]";
  const std::vector<std::string> fine = {"subject.rings=80", "implicit.resolution=70"};
  const auto plain = StageOf(Phantom30(fmt::format("mine: {{{}, depth: auto}}", kMiddle), fine));
  const Dowel& open = At(plain->depth_stage->subject.dowels_on_bone, "mine");
  const auto pulled =
      StageOf(Phantom30(fmt::format("mine: {{{}, depth: {}}}", kMiddle, open.depth_mm + 4), fine));
  const Vec3 tip = At(pulled->depth_stage->subject.dowels_on_bone, "mine").Tip();
  const double before_mm = MeshQuery(plain->implicit.dense).Closest(tip).distance_mm,
               after_mm = MeshQuery(pulled->implicit.dense).Closest(tip).distance_mm;
  EXPECT_GT(before_mm, 3);
  EXPECT_LT(after_mm, 0.6 * before_mm);
}

TEST(ExtraDowels, OneUnderTheFaceStandsOnTheBoneBehindItsUv) {
  const Case subject = CaseOf(Phantom30("mine: {uv: [0.6, 0.45], depth: 8}"));
  const Dowel& mine = At(subject.dowels_on_bone, "mine");
  EXPECT_EQ(mine.role, PointRole::kInserted);
  EXPECT_LT(MeshQuery(subject.skull).Closest(mine.base).distance_mm, 1e-6);
  EXPECT_GT(mine.base.x(), 5);  // u > 0.5 is the subject's left
  EXPECT_THAT(subject.notes, Contains(HasSubstr("mine: dowel inserted, 8 mm, set by hand")));
}

TEST(ExtraDowels, ATablesOwnSiteHasItsDepth) {
  const std::string table = SEMBLANCE_SOURCE_DIR "/configs/tables/t_table_2023.yaml";
  const Case subject = CaseOf(
      Phantom30("mn: {near: [n, rhi]}, mmb_l: {near: [pg, go_l]}, op: {near: [0, 180, 0]}",
                {"tissue={depths: table, table: " + table + "}", "landmarks.max_distance_mm=50"}));
  EXPECT_EQ(At(subject.dowels_on_bone, "mn").depth_mm, 4.5);
  EXPECT_EQ(At(subject.dowels_on_bone, "mn").sd_mm, 1.5);
  EXPECT_EQ(At(subject.dowels_on_bone, "op").depth_mm, 6);
  EXPECT_EQ(At(subject.dowels_on_bone, "mmb_l").role, PointRole::kLandmark);
  EXPECT_THAT(subject.notes, Contains(HasSubstr("from table 't_table_2023'")));
}

TEST(ExtraDowels, ADepthThatIsNotStatedIsTheTissuesWithAllThatItSays) {
  const std::string table = SEMBLANCE_SOURCE_DIR "/configs/tables/t_table_2023.yaml";
  const auto of = [&](std::vector<std::string> overrides) {
    overrides.insert(overrides.begin(), "tissue={depths: table, table: " + table + "}");
    return CaseOf(Phantom30("mn: {near: [n, rhi]}", overrides));
  };
  EXPECT_EQ(At(of({"tissue.sds=1"}).dowels_on_bone, "mn").depth_mm, 4.5 + 1.5);
  EXPECT_EQ(At(of({"tissue.sds=-3"}).dowels_on_bone, "mn").depth_mm, 0.5);
  const Case set = of({"tissue.set_mm={mn: 7}"});
  EXPECT_EQ(At(set.dowels_on_bone, "mn").depth_mm, 7);
  EXPECT_THAT(set.notes, Contains(HasSubstr("mn (Mid-nasal): depth set to 7 mm by hand")));
  EXPECT_THAT(set.notes, Not(Contains(HasSubstr("no dowel uses the depth"))));
  const Case known = of({"tissue.given={depths_mm: {mn: 6}}"});
  EXPECT_EQ(At(known.dowels_on_bone, "mn").depth_mm, 6);
  EXPECT_THAT(known.notes, Contains(HasSubstr("6 mm, known of this person")));
  const Case measured = CaseOf(Phantom30("mn: {near: [n, rhi]}", {"tissue.set_mm={mn: 7}"}));
  EXPECT_EQ(At(measured.dowels_on_bone, "mn").depth_mm, 7);
}

TEST(ExtraDowels, SitesThatCannotBePlacedAreNamedInOneLine) {
  const auto words = [](const std::string& sites, std::vector<std::string> overrides = {}) {
    return WordsOf<InputError>([&] { CaseOf(Phantom30(sites, std::move(overrides))); });
  };
  EXPECT_THAT(words("n: {near: [0, 0, 0], depth: 3}"),
              HasSubstr("sites.n: n (Nasion) appears twice, as it is among the landmarks"));
  EXPECT_THAT(words("mine: {near: n, depth: 3}"), HasSubstr("at the same place as n (Nasion)"));
  EXPECT_THAT(words("mine: {near: [n, rhi]}"), HasSubstr("sites.mine: no depth is given"));
  EXPECT_THAT(words("mine: {near: [0, -300, 0], depth: 3}"), HasSubstr("mm from the skull"));
  EXPECT_THAT(words("mn: {depth: 3}"), HasSubstr("sites.mn: mn (Mid-nasal) is not among the"));
  EXPECT_THAT(words("n: {depth: auto}"), HasSubstr("sites.n.depth: auto is for a site that is"));
  EXPECT_THAT(words("n: {depth: 5}", {"tissue.set_mm={n: 6}"}), HasSubstr("appears twice, here"));
  EXPECT_THAT(words("mn: {near: [n, rhi], depth: 5}", {"tissue.set_mm={mn: 6}"}),
              HasSubstr("sites.mn.depth: the depth appears twice, here"));
}

// (u,v) of the sites of a standard network, and one dowel in an area and one on an edge of it.
TEST(ExtraDowels, TheUvOfAnInsertedDowelIsInterpolatedLikeADepth) {
  const TemplateFace face{.surface = MakeTemplateFace({}).surface,
                          .site_uv = {{"a", {0.2, 0.3}}, {"b", {0.6, 0.3}}, {"c", {0.2, 0.9}}},
                          .features = {}};
  const auto dowel = [](const std::string& site, const Vec3& base) {
    return Dowel{.site = site, .base = base, .direction = Vec3::UnitZ(), .depth_mm = 5};
  };
  const std::vector<Dowel> dowels = {dowel("a", {0, 0, 0}),     dowel("b", {40, 0, 0}),
                                     dowel("c", {0, 40, 0}),    dowel("inside", {10, 20, 0}),
                                     dowel("edge", {30, 0, 0}), dowel("outside", {-30, -5, 0})};
  DowelNetwork network{.areas = {{0, 1, 2}}, .dropped = {}};
  Experiment experiment;
  experiment.inserted_uv = InsertedUv::kNeighbours;
  for (const bool joined : {false, true}) {  // whether the network has areas of the new dowel
    if (joined) {
      ASSERT_EQ(InsertIntoNetwork(dowels, 3, network), Insertion::kInside);
    }
    const FitTarget target = AllDowels(dowels, network, face, experiment);
    ASSERT_EQ(target.points.size(), 6u);
    EXPECT_LT((target.points[3].uv - Vec2(0.2 + 0.25 * 0.4, 0.3 + 0.5 * 0.6)).norm(), 1e-12);
    EXPECT_LT((target.points[4].uv - Vec2(0.5, 0.3)).norm(), 1e-12);
    experiment.inserted_uv = InsertedUv::kRay;
    const FitTarget rays = AllDowels(dowels, network, face, experiment);
    experiment.inserted_uv = InsertedUv::kNeighbours;
    EXPECT_EQ(target.points[5].uv, rays.points[5].uv) << "outside the network";
    EXPECT_NE(target.points[3].uv, rays.points[3].uv);
  }
}

TEST(ExtraDowels, WithoutSeedsTheFitHasTheDowelsAlone) {
  const Experiment experiment =
      Phantom30("", {"face=fit", "seeds=none", "uncertainty.sigma=false"});
  EXPECT_THAT(UnusedOptions(experiment), ::testing::IsEmpty());
  const RunResult result = problems::Run(experiment, {});
  EXPECT_TRUE(result.seeding.points.empty());
  EXPECT_EQ(result.seeding.masked, 0);
  EXPECT_EQ(result.target.points.size(), result.subject.dowels_on_bone.size());
  EXPECT_TRUE(result.fit.usable);
  EXPECT_EQ(result.fit.dowel_rms_mm, result.fit.point_rms_mm);
}

TEST(ExtraDowels, AUvSetByHandIsTheFitsAndStaysWhereItIsHeldThorough) {
  const std::vector<std::string> quick = {"seeds.level=1", "uncertainty.sigma=false"};
  StageCache cache(8);
  const auto uv_of = [&](const std::string& sites) {
    const RunResult result = problems::Run(Phantom30(sites, quick), {}, &cache);
    for (std::size_t k = 0; k < result.target.points.size(); ++k) {
      if (result.target.points[k].label == "go_l") {
        return result.fit.uv[k];
      }
    }
    return Vec2(kNaN, kNaN);
  };
  EXPECT_EQ(uv_of("go_l: {uv: [0.81, 0.31], hold: true}"), Vec2(0.81, 0.31));
  EXPECT_NE(uv_of("go_l: {uv: [0.81, 0.31]}"), Vec2(0.81, 0.31));
}

TEST(ExtraDowels, AGivenDirectionIsKeptAndListed) {
  const Case own = CaseOf(Phantom30(fmt::format("mine: {{{}, depth: 5}}", kCheek)));
  const Vec3 bone = At(own.dowels_on_bone, "mine").direction;
  EXPECT_FALSE(own.turns_deg.contains("mine"));
  const Vec3 turned = Eigen::AngleAxisd(20 * std::numbers::pi / 180, bone.unitOrthogonal()) * bone;
  const Case subject =
      CaseOf(Phantom30(fmt::format("mine: {{{}, depth: 5, direction: [{}, {}, {}]}}", kCheek,
                                   3 * turned.x(), 3 * turned.y(), 3 * turned.z())));
  EXPECT_NEAR((At(subject.dowels_on_bone, "mine").direction - turned).norm(), 0, 1e-9);
  EXPECT_NEAR(subject.turns_deg.at("mine"), 20, 1e-6);
}

TEST(ExtraDowels, ADirectionIntoTheHeadIsRefused) {
  const auto words = [](const std::string& direction) {
    return WordsOf<Error>([&] {
      CaseOf(Phantom30(fmt::format("mine: {{{}, depth: 5, direction: {}}}", kCheek, direction)));
    });
  };
  EXPECT_THAT(words("[0, 1, 0]"), HasSubstr("into the head"));
  EXPECT_THAT(words("[0, 0, 0]"), HasSubstr("has no length"));
  EXPECT_THAT(WordsOf<Error>([] { CaseOf(Phantom30("n: {direction: [0, -1, 0]}")); }),
              HasSubstr("give that landmark a `normal` instead"));
}

}  // namespace
}  // namespace semblance::problems
