// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/feature_rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "problems/face/hspline_prior.h"
#include "problems/face/template_source.h"
#include "problems/subject/average_skull.h"
#include "surfaces/base/error.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const FacePrior& Ict() {
  static const FacePrior prior = LoadPrior(IctPrior{.count = 1}, LoadTemplate(IctTemplate{}));
  return prior;
}

std::map<std::string, Vec3> AverageLandmarks() {
  std::map<std::string, Vec3> points;
  for (const char* const site : {"n", "rhi", "pr", "mso_l", "mso_r", "mio_l", "mio_r"}) {
    points[site] = AverageSite(site);
  }
  return points;
}

FeatureRules AllRules() {
  FeatureRules rules;
  rules.pronasale.use = rules.subnasale.use = rules.eye_protrusion.use = true;
  rules.points = {{"dlom_l", {47, 22, -8}}, {"dlom_r", {-47, 22, -8}}, {"uc_l", {19, 8, -72}},
                  {"uc_r", {-19, 8, -72}},  {"ans", {0, -2, -50}},     {"ss", {0, 2, -58}}};
  return rules;
}

std::vector<std::string> Names(const RuleMarks& marks) {
  std::vector<std::string> names;
  for (const AppliedRule& rule : marks.rules) {
    names.push_back(rule.rule + " " + rule.point + " " + rule.coordinate);
  }
  return names;
}

TEST(FeatureRules, ARuleIsOnWhenItsPointsAreThere) {
  EXPECT_THAT(Names(ApplyRules({}, AverageLandmarks(), {}, Ict())),
              ::testing::ElementsAre("eye_height eye_r height", "eye_height eye_l height"));
  EXPECT_THAT(
      Names(ApplyRules(AllRules(), AverageLandmarks(), {}, Ict())),
      ::testing::ElementsAre("eye_height eye_r height", "eye_height eye_l height",
                             "eye_protrusion eye_r front", "eye_protrusion eye_l front",
                             "mouth_width ch_r side", "mouth_width ch_l side",
                             "pronasale prn front", "pronasale prn height", "subnasale sn front"));
  FeatureRules off = AllRules();
  off.eye_height.use = off.eye_protrusion.use = off.mouth_width.use = off.pronasale.use = false;
  off.subnasale.use = false;
  EXPECT_TRUE(ApplyRules(off, AverageLandmarks(), {}, Ict()).marks.empty());
}

TEST(FeatureRules, PointsStandOnTheBoneAndOnTheirSide) {
  const MeshQuery ball(testing::SphereMesh({0, 0, 0}, 60, 60));
  const Similarity pose;
  const auto mistakes = [&](const char* left, const char* right, const Similarity* known) {
    FeatureRules rules;
    rules.points = {{left, {36, -48, 0}}, {right, {-36, -48, 0}}, {"ss", {0, -60, 0}}};
    return CheckRulePoints(rules, ball, known, {});
  };
  EXPECT_THAT(mistakes("uc_l", "uc_r", &pose), IsEmpty());
  EXPECT_THAT(mistakes("uc_r", "uc_l", &pose),
              ElementsAre(HasSubstr("rules.points.uc_l: it lies 36 mm to the right"),
                          HasSubstr("rules.points.uc_r: it lies 36 mm to the left")));
  EXPECT_THAT(mistakes("uc_r", "uc_l", nullptr), IsEmpty());  // of a pose that is not known
  FeatureRules far;
  far.points = {{"uc_l", {18000, 0, -60}}};
  EXPECT_THAT(CheckRulePoints(far, ball, &pose, {}),
              ElementsAre(HasSubstr("rules.points.uc_l: it is 17940.1 mm from the skull")));
}

TEST(FeatureRules, PredictionsFollowTheFormulas) {
  const RuleMarks all = ApplyRules(AllRules(), AverageLandmarks(), {}, Ict());
  const auto mark = [&](std::size_t k) { return all.marks.at(k).position; };
  const double upper = AverageSite("mso_l").z(), lower = AverageSite("mio_l").z();
  EXPECT_NEAR(mark(1).z(), upper - 0.441 * (upper - lower), 1e-9);
  EXPECT_NEAR(mark(3).y(), 22 - 16.2, 1e-9);                 // the face looks to -y
  EXPECT_NEAR(mark(5).x() - mark(4).x(), 38 / 0.758, 1e-9);  // corner to corner
  // n at the origin, pr 67 mm down and 1 mm in front.
  const Vec3 n = Vec3::Zero(), down = AverageSite("pr").normalized(),
             front = Vec3::UnitX().cross(down);
  const double anterior = 0.83 * (AverageSite("rhi") - Vec3(0, 2, -58)).norm() - 3.5,
               vertical = 0.9 * Vec3(0, -2, -50).norm() - 2;
  const Vec3 tip = mark(6) - n;
  EXPECT_NEAR(tip.dot(down), vertical, 1e-9);
  EXPECT_NEAR(std::abs(tip.dot(front)), anterior, 1e-9);
  EXPECT_LT(tip.y(), 0);
  EXPECT_NEAR(mark(8).y(), 2 - 13.5, 1e-9);
}

// The marks lie on the landmarks of their names: the mean's own eyes, corners and tip.
TEST(FeatureRules, MarksLieOnTheirLandmarks) {
  const RuleMarks all = ApplyRules(AllRules(), AverageLandmarks(), {}, Ict());
  const TriMesh& mean = Ict().model.mean;
  const auto at = [&](std::size_t k) {
    return FindPosition(all.marks.at(k).at.front(), mean, mean.points);
  };
  EXPECT_GT(at(1).x(), 15);  // eye_l
  EXPECT_LT(at(0).x(), -15);
  EXPECT_NEAR(at(5).x(), 25, 2);  // ch_l
  const double tip_y = std::ranges::min(mean.points, {}, [](const Vec3& p) { return p.y(); }).y();
  EXPECT_NEAR(at(6).y(), tip_y, 1.5);
  EXPECT_GT(at(8).y(), tip_y + 8);  // the nose's base, behind and under its tip
  EXPECT_LT(at(8).z(), at(6).z() - 5);
  EXPECT_NEAR(at(8).x(), 0, 1);
}

TEST(FeatureRules, AnEstimateFollowsAMark) {
  ShapeTarget target{.start = {}, .tips = {}, .surface = nullptr, .features = {}};
  for (const auto& [site, at] : Ict().sites) {
    ShapeTip tip{.label = site, .at = at};
    tip.position = FindPosition(at, Ict().model.mean, Ict().model.mean.points);
    target.tips.push_back(tip);
  }
  RuleMarks rules = ApplyRules({}, AverageLandmarks(), {}, Ict());
  ShapeMark mark = rules.marks.at(0);
  const Vec3 eye = FindPosition(mark.at.front(), Ict().model.mean, Ict().model.mean.points);
  mark.position = eye + 3 * Vec3::UnitZ();
  mark.at.resize(1);
  ShapeFitOptions options;
  options.field.centres = 30;
  const ShapeEstimate before = EstimateShape(Ict().model, target, options, {});
  target.marks = {mark};
  const ShapeEstimate after = EstimateShape(Ict().model, target, options, {});
  const auto height = [&](const ShapeEstimate& e) {
    return FindPosition(mark.at.front(), Ict().model.mean, e.points).z();
  };
  EXPECT_GT(height(after), height(before) + 0.1);
  EXPECT_NEAR(after.mark_residual_mm.at(0), mark.position.z() - height(after), 1e-9);
  target.marks[0].sd_mm = 0;
  EXPECT_THROW(EstimateShape(Ict().model, target, options, {}), InputError);
}

TEST(FeatureRules, TheNoteOfARequestedRuleNamesWhatItLacks) {
  FeatureRules rules;
  EXPECT_THAT(ExplainUnusedRules(rules, {}, /*is_posed=*/true, &Ict()),
              IsEmpty());  // none of these was requested
  rules.pronasale.use = rules.mouth_width.use = true;
  EXPECT_THAT(ExplainUnusedRules(rules, AverageLandmarks(), /*is_posed=*/true, &Ict()),
              ElementsAre("rules.mouth_width is on, and it lacks uc_l, uc_r under rules.points: it "
                          "does not apply",
                          "rules.pronasale is on, and it lacks ans, ss under rules.points: it does "
                          "not apply"));
  rules.mouth_width.use = false;
  rules.points = AllRules().points;
  EXPECT_THAT(ExplainUnusedRules(rules, AverageLandmarks(), /*is_posed=*/true, &Ict()), IsEmpty());
  rules.points.erase("ss");
  EXPECT_THAT(ExplainUnusedRules(rules, {}, /*is_posed=*/true, &Ict()),
              ElementsAre(HasSubstr("it lacks ss under rules.points and n, pr, rhi among the "
                                    "landmarks: it does not apply")));
  EXPECT_THAT(ExplainUnusedRules(rules, AverageLandmarks(), /*is_posed=*/false, &Ict()),
              ElementsAre(HasSubstr("rules.pronasale is on, and the skull's pose is not known")));
  EXPECT_THAT(ExplainUnusedRules(rules, AverageLandmarks(), /*is_posed=*/true, nullptr),
              ElementsAre(HasSubstr("rules.pronasale is on, and the face uses no prior")));
}

TEST(FeatureRules, APriorWithoutTheirLandmarksIsNoted) {
  FacePrior few = Ict();
  few.features.resize(33);
  FeatureRules rules;
  EXPECT_TRUE(ApplyRules(rules, AverageLandmarks(), {}, few).marks.empty());
  EXPECT_THAT(ExplainUnusedRules(rules, AverageLandmarks(), /*is_posed=*/true, &few),
              ElementsAre(HasSubstr("the prior has 33 landmarks, and rules need 41")));
  rules.eye_height.use = rules.eye_protrusion.use = rules.mouth_width.use = false;
  rules.pronasale.use = rules.subnasale.use = false;
  EXPECT_THAT(ExplainUnusedRules(rules, AverageLandmarks(), /*is_posed=*/true, &few), IsEmpty());
}

// Whatever point is missing, the notes state correctly whether a rule applies to no side or to one.
TEST(FeatureRules, NotesMatchTheAppliedRules) {
  FeatureRules all = AllRules();
  all.eye_height.use = all.mouth_width.use = true;
  const std::vector<std::string> whole = Names(ApplyRules(all, AverageLandmarks(), {}, Ict()));
  const auto expect_told = [&](const FeatureRules& rules, const std::map<std::string, Vec3>& bone) {
    const std::vector<std::string> names = Names(ApplyRules(rules, bone, {}, Ict()));
    const std::vector<std::string> notes =
        ExplainUnusedRules(rules, bone, /*is_posed=*/true, &Ict());
    for (const std::string rule :
         {"eye_height", "eye_protrusion", "mouth_width", "pronasale", "subnasale"}) {
      const auto of_rule = [&](const std::string& name) { return name.starts_with(rule + " "); };
      const auto at_work = std::ranges::count_if(names, of_rule),
                 at_most = std::ranges::count_if(whole, of_rule);
      const auto note = std::ranges::find_if(notes, [&](const std::string& words) {
        return words.starts_with("rules." + rule + " is on");
      });
      ASSERT_EQ(note == notes.end(), at_work == at_most) << rule;
      if (note != notes.end()) {
        EXPECT_THAT(*note, HasSubstr(at_work == 0 ? "does not apply" : "to one side alone"));
      }
    }
  };
  expect_told(all, AverageLandmarks());
  for (const auto& [code, at] : all.points) {
    FeatureRules without = all;
    without.points.erase(code);
    expect_told(without, AverageLandmarks());
  }
  for (const auto& [code, at] : AverageLandmarks()) {
    std::map<std::string, Vec3> without = AverageLandmarks();
    without.erase(code);
    expect_told(all, without);
  }
}

TEST(FeatureRules, AnUnknownPointIsAFault) {
  FeatureRules rules;
  rules.points["acanthion"] = {0, 0, 0};
  ASSERT_EQ(CheckRules(rules).size(), 1u);
  EXPECT_EQ(CheckRules(rules)[0].path, "points.acanthion");
  EXPECT_THAT(CheckRules(rules)[0].what, HasSubstr("dlom_l, dlom_r, uc_l, uc_r, ans, ss"));
  EXPECT_TRUE(CheckRules(AllRules()).empty());
}

}  // namespace
}  // namespace semblance::problems
