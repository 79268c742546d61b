// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/evaluation/cross_validation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "surfaces/base/error.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

// Each left out alone.
Folds EachDowel(std::span<const Dowel> dowels) {
  Folds folds;
  for (std::size_t i = 0; i < dowels.size(); ++i) {
    folds.push_back({i});
  }
  return folds;
}

using testing::DomeScene;
using testing::DowelScene;
using ::testing::ElementsAre;
using testing::FlatScene;
using testing::OnThreads;
using testing::ScatteredScene;

CrossValidation Validate(const DepthScheme& scheme, const DowelScene& scene,
                         const OutsideRule& rule = LeaveUnassigned{}) {
  return CrossValidate(scheme, rule, scene.Input(), EachDowel(scene.dowels), OnThreads(1));
}

std::string ErrorOf(const DowelScene& scene, const Folds& folds) {
  try {
    CrossValidate(Mean{}, LeaveUnassigned{}, scene.Input(), folds, OnThreads(1));
  } catch (const InputError& e) {
    return e.what();
  }
  return "no error";
}

TEST(Folds, AreLandmarksOfBothSides) {
  const DowelScene scene = DomeScene();  // sg mso_l mso_r n me
  EXPECT_THAT(EachLandmark(scene.dowels),
              ElementsAre(ElementsAre(0), ElementsAre(1, 2), ElementsAre(3), ElementsAre(4)));
}

TEST(Folds, OfASideAreItsDowels) {
  EXPECT_THAT(EachSide(DomeScene().dowels), ElementsAre(ElementsAre(1), ElementsAre(2)));
  EXPECT_TRUE(EachSide(FlatScene().dowels).empty());
  std::vector<Dowel> left = {DomeScene().dowels[1]};
  EXPECT_TRUE(EachSide(left).empty());  // nothing would be left to predict from
}

TEST(Folds, DrawnOnesHoldEachDowelOnceAndNoOrderMatters) {
  const DowelScene scene = ScatteredScene(23);
  const Folds folds = RandomFolds(scene.dowels, 5, 3);
  ASSERT_EQ(folds.size(), 5u);
  std::vector<std::size_t> all;
  for (const auto& fold : folds) {
    EXPECT_GE(fold.size(), 4u);
    EXPECT_LE(fold.size(), 5u);
    all.insert(all.end(), fold.begin(), fold.end());
  }
  std::ranges::sort(all);
  for (std::size_t i = 0; i < 23; ++i) {
    EXPECT_EQ(all[i], i);
  }
  EXPECT_NE(RandomFolds(scene.dowels, 5, 4), folds);
  EXPECT_EQ(RandomFolds(scene.dowels, 5, 3), folds);
  std::vector<Dowel> turned(scene.dowels.rbegin(), scene.dowels.rend());
  Folds back = RandomFolds(turned, 5, 3);
  for (auto& fold : back) {
    for (std::size_t& i : fold) {
      i = 22 - i;
    }
    std::ranges::sort(fold);
  }
  EXPECT_EQ(back, folds);
  EXPECT_EQ(RandomFolds(FlatScene().dowels, 9, 1).size(), 4u);
  EXPECT_THROW(RandomFolds(scene.dowels, 1, 1), InputError);
}

TEST(CrossValidation, OfTheMeanIsTheMeanOfTheOthers) {  // depths 4, 7, 9, 5
  const CrossValidation result = Validate(Mean{}, FlatScene());
  const std::vector<double> predicted = {7, 6, 16 / 3., 20 / 3.};
  const std::vector<double> depth = {4, 7, 9, 5};
  double squares = 0;
  ASSERT_EQ(result.left_out.size(), 4u);
  for (int k = 0; k < 4; ++k) {
    const LeftOut& out = result.left_out[k];
    EXPECT_EQ(out.site, FlatScene().dowels[k].site);
    EXPECT_EQ(out.depth_mm, depth[k]);
    EXPECT_NEAR(out.predicted_mm, predicted[k], 1e-12);
    EXPECT_NEAR(out.error_mm, predicted[k] - depth[k], 1e-12);
    EXPECT_TRUE(out.within_90.has_value());
    squares += out.error_mm * out.error_mm;
  }
  EXPECT_EQ(result.predicted, 4);
  EXPECT_NEAR(result.rms_mm, std::sqrt(squares / 4), 1e-12);
  EXPECT_NEAR(result.mean_mm, 0, 1e-12);
  EXPECT_NEAR(result.mean_absolute_mm, (3 + 1 + 11 / 3. + 5 / 3.) / 4, 1e-12);
  EXPECT_NEAR(result.most_mm, 11 / 3., 1e-12);
}

// The mean states no sd, so that the sd of each dowel is learned from the others.
TEST(CrossValidation, LearnsAnSdFromTheOtherFolds) {
  const CrossValidation result = Validate(Mean{}, FlatScene());
  EXPECT_FALSE(result.own_sd);
  for (std::size_t k = 0; k < 4; ++k) {
    std::vector<double> errors, distances;
    for (std::size_t j = 0; j < 4; ++j) {
      if (j != k) {
        errors.push_back(result.left_out[j].error_mm);
        distances.push_back(result.left_out[j].nearest_mm);
      }
    }
    const LeftOut& out = result.left_out[k];
    EXPECT_EQ(out.nearest_mm, 30);
    EXPECT_NEAR(out.sd_mm, FitSdByDistance(errors, distances).At(30), 1e-12);
    EXPECT_EQ(out.within_90, std::abs(out.error_mm) <= 1.6448536269514722 * out.sd_mm);
  }
  EXPECT_TRUE(Validate(Kriging{}, ScatteredScene(20)).own_sd);
}

// If the network ends without a left-out dowel, the outside rule predicts, and the scheme gets no
// score.
TEST(CrossValidation, ScoresTheSchemesOwnPredictions) {
  DowelScene scene = FlatScene();
  scene.dowels.push_back({"zz", {20, 20, 0}, Vec3(0, 0, 1), 12, 1});
  scene.network.areas = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  const CrossValidation result = Validate(Barycentric{}, scene, ConstantDepth{.depth_mm = 6});
  EXPECT_EQ(result.scores.points, 1);
  EXPECT_NEAR(result.scores.mae_mm, std::abs(result.left_out[4].error_mm), 1e-12);
  EXPECT_EQ(result.scores_with_rule.points, 5);
  EXPECT_NEAR(result.scores_with_rule.mae_mm, result.mean_absolute_mm, 1e-12);
}

TEST(CrossValidation, GivesAFieldTheSdThatItsErrorsShow) {
  const DowelScene scene = ScatteredScene(20);
  const CrossValidation known = Validate(Nearest{}, scene);
  const DepthField plain = InterpolateDepth(Nearest{}, scene.Input(), {});
  const DepthField field = WithStatedSd(plain, known, scene.Input(), {});
  for (std::size_t v = 0; v < field.status.size(); v += 50) {
    double nearest_mm = 1e9;
    for (const Dowel& dowel : scene.dowels) {
      nearest_mm = std::min(nearest_mm, (dowel.base - scene.skull.points[v]).norm());
    }
    EXPECT_EQ(std::isfinite(field.sd_mm[v]), std::isfinite(field.depth_mm[v]));
    if (std::isfinite(field.depth_mm[v])) {
      EXPECT_NEAR(field.sd_mm[v], known.sd.At(nearest_mm), 1e-12);
    }
  }
  const DepthField own = InterpolateDepth(Kriging{}, scene.Input(), {});
  EXPECT_TRUE(
      testing::SameBytes(WithStatedSd(own, Validate(Kriging{}, scene), scene.Input(), {}), own));
}

// Schemes that pass on the dowels' sd state 0 everywhere if all dowels are exact.
TEST(CrossValidation, TheSdOfExactDowelsIsNotUsedBetweenThem) {
  DowelScene scene = ScatteredScene(20);
  for (Dowel& dowel : scene.dowels) {
    dowel.sd_mm = 0;
  }
  const CrossValidation known = Validate(Nearest{}, scene);
  EXPECT_FALSE(known.own_sd);
  EXPECT_EQ(known.scores.certain, 0);
  EXPECT_GT(known.coverage_90, 0.5);
  const DepthField field =
      WithStatedSd(InterpolateDepth(Nearest{}, scene.Input(), {}), known, scene.Input(), {});
  for (std::size_t v = 0; v < field.status.size(); ++v) {
    EXPECT_TRUE(!std::isfinite(field.depth_mm[v]) || field.sd_mm[v] > 0);
  }
  scene.dowels[3].sd_mm = 1;  // one dowel is not exact: the scheme's sd is used, also where it is 0
  EXPECT_TRUE(Validate(Nearest{}, scene).own_sd);
}

TEST(CrossValidation, MarksErrorsWithinTheStatedSd) {
  // sg is equally near to g and rhi, and g comes first: 7 +- 2 for 4. n gets 7 +- 2 for 9. g is
  // equally near to n and sg, and n comes first: 9 +- 3. rhi gets n's 9 +- 3 for 5.
  CrossValidation result = Validate(Nearest{}, FlatScene());
  EXPECT_THAT(result.left_out[0].within_90, ::testing::Optional(true));  // 3 < 3.29
  EXPECT_EQ(result.left_out[0].sd_mm, 2);
  EXPECT_EQ(result.coverage_90, 1);
  DowelScene scene = FlatScene();
  scene.dowels[1].sd_mm = 1;
  result = Validate(Nearest{}, scene);
  EXPECT_THAT(result.left_out[0].within_90, ::testing::Optional(false));  // 3 > 1.645
  EXPECT_EQ(result.coverage_90, 0.5);
}

TEST(CrossValidation, RemovesTheAreasOfALeftOutDowel) {
  // Without sg the area of the other three remains. sg is outside it, so that the rule predicts.
  const CrossValidation none = CrossValidate(Barycentric{}, LeaveUnassigned{}, FlatScene().Input(),
                                             {{1}, {3}}, OnThreads(1));
  EXPECT_EQ(none.predicted, 0);
  EXPECT_TRUE(std::isnan(none.rms_mm));
  EXPECT_EQ(none.left_out[0].status, DepthStatus::kOutside);
  const CrossValidation filled = CrossValidate(Barycentric{}, ConstantDepth{.depth_mm = 6},
                                               FlatScene().Input(), {{1}, {3}}, OnThreads(1));
  EXPECT_EQ(filled.predicted, 2);
  EXPECT_EQ(filled.left_out[0].error_mm, -1);
  EXPECT_EQ(filled.left_out[1].error_mm, 1);
  EXPECT_EQ(filled.left_out[0].status, DepthStatus::kOutside);
}

TEST(CrossValidation, LeavesAFoldOutTogether) {
  const DowelScene scene = FlatScene();
  const CrossValidation result =
      CrossValidate(Mean{}, LeaveUnassigned{}, scene.Input(), {{0, 1}, {2, 3}}, OnThreads(1));
  EXPECT_EQ(result.left_out[0].predicted_mm, 7);
  EXPECT_EQ(result.left_out[1].predicted_mm, 7);
  EXPECT_EQ(result.left_out[2].predicted_mm, 5.5);
}

TEST(CrossValidation, EvaluatesSchemesOnTheSurfaceAtTheDowel) {
  const DowelScene scene = ScatteredScene(8);
  DowelScene without = scene;
  without.dowels.erase(without.dowels.begin() + 6);
  const DepthField field = InterpolateDepth(Biharmonic{}, without.Input(), RunContext{});
  const auto at =
      std::ranges::find(scene.skull.points, scene.dowels[6].base) - scene.skull.points.begin();
  const CrossValidation result = Validate(Biharmonic{}, scene);
  EXPECT_NEAR(result.left_out[6].predicted_mm, field.depth_mm[at], 1e-9);
  EXPECT_EQ(result.left_out[6].status, DepthStatus::kAssigned);
}

TEST(CrossValidation, PrefersASmoothSchemeOnASmoothDepth) {
  const DowelScene scene = ScatteredScene(40);
  const double mean = Validate(Mean{}, scene).rms_mm;
  const double nearest = Validate(Nearest{}, scene).rms_mm;
  const double kriging = Validate(Kriging{}, scene).rms_mm;
  EXPECT_LT(nearest, mean);
  EXPECT_LT(kriging, nearest);
  EXPECT_LT(Validate(RadialBasis{}, scene).rms_mm, nearest);
}

TEST(CrossValidation, DoesNotDependOnThreads) {
  const DowelScene scene = ScatteredScene(8);
  for (const DepthScheme& scheme : {DepthScheme{Kriging{}}, DepthScheme{Harmonic{}}}) {
    const auto errors = [&](int threads) {
      std::vector<double> all;
      for (const LeftOut& out : CrossValidate(scheme, LeaveUnassigned{}, scene.Input(),
                                              EachDowel(scene.dowels), OnThreads(threads))
                                    .left_out) {
        all.push_back(out.error_mm);
      }
      return all;
    };
    EXPECT_EQ(errors(1), errors(2));
  }
}

// If a pair is left out of four or five dowels, too few remain for the three factors of a mean.
TEST(CrossValidation, UsesTheRuleIfAFoldLeavesTooFewDowels) {
  DowelScene scene = ScatteredScene(5);
  const Kriging relief{.mean = DepthMean::kCovariates};
  for (const DepthScheme& scheme :
       {DepthScheme{relief}, DepthScheme{AutoScheme{.schemes = {relief}}}}) {
    const CrossValidation result = CrossValidate(scheme, ConstantDepth{.depth_mm = 6},
                                                 scene.Input(), {{0, 1, 2}, {3}}, OnThreads(1));
    EXPECT_EQ(result.predicted, 4);
    EXPECT_EQ(result.left_out[0].predicted_mm, 6);
    EXPECT_EQ(result.left_out[0].status, DepthStatus::kOutside);
    EXPECT_EQ(result.left_out[3].status, DepthStatus::kAssigned);
  }
}

TEST(CrossValidation, ReportsAFaultyFold) {
  const DowelScene scene = FlatScene();
  EXPECT_EQ(ErrorOf(scene, {{0}, {4}}),
            "cross-validation: fold 1 names dowel 4, but there are 4 (0..3); make the folds from "
            "these dowels");
  EXPECT_EQ(ErrorOf(scene, {{0, 1, 2, 3}}),
            "cross-validation: fold 0 leaves out all of the 4 dowels; at least one must be left "
            "to predict from");
}

}  // namespace
}  // namespace semblance::interp
