// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_actions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/app/workbench/bench_state.h"
#include "problems/config/config.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

BenchState WithGlabella() { return PlaceLandmark({}, "g", {1, 2, 3}); }

std::vector<std::string> SiteCodes(const BenchState& state) {
  std::vector<std::string> sites;
  for (const BenchLandmark& landmark : state.landmarks) {
    sites.push_back(landmark.site);
  }
  return sites;
}

std::vector<std::string> SettingTexts(const BenchState& state) {
  std::vector<std::string> settings;
  for (const BenchSetting& setting : state.settings) {
    settings.push_back(setting.path + "=" + setting.value);
  }
  return settings;
}

TEST(BenchActions, AMovedLandmarkKeepsItsRemarksButNotItsNormal) {
  BenchState state = RemarkLandmark(
      WithGlabella(), "g",
      {.certainty = Certainty::kHigh, .note = "clear", .depth_along_normal_mm = 4.5});
  state.landmarks[0].normal = {0, -1, 0};
  state.landmarks[0].proposed = true;
  const BenchLandmark moved = PlaceLandmark(state, "g", {4, 5, 6}).landmarks.at(0);
  EXPECT_THAT(moved.point, ElementsAre(4, 5, 6));
  EXPECT_EQ(moved.note, "clear");
  EXPECT_EQ(moved.depth_along_normal_mm, 4.5);
  EXPECT_FALSE(moved.normal);
  EXPECT_FALSE(moved.proposed);
  EXPECT_THAT(state.landmarks[0].point, ElementsAre(1, 2, 3)) << "the old state is a value";
}

TEST(BenchActions, ASiteIsEitherPlacedOrAbsent) {
  const BenchState absent = MarkAbsent(WithGlabella(), "g", "broken");
  EXPECT_THAT(absent.landmarks, IsEmpty());
  ASSERT_THAT(absent.absent, SizeIs(1));
  const BenchState placed = PlaceLandmark(absent, "g", {1, 2, 3});
  EXPECT_THAT(placed.absent, IsEmpty());
  EXPECT_THAT(SiteCodes(placed), ElementsAre("g"));
}

TEST(BenchActions, RenamingToAPlacedNameExchangesTheTwo) {
  const BenchState two = PlaceLandmark(PlaceLandmark({}, "go_l", {1, 0, 0}), "go_r", {2, 0, 0});
  const BenchState swapped = RenameLandmark(two, "go_l", "go_r");
  EXPECT_THAT(SiteCodes(swapped), ElementsAre("go_r", "go_l"));
  EXPECT_THAT(swapped.landmarks[0].point, ElementsAre(1, 0, 0));
}

TEST(BenchActions, ProposalsDoNotChangeAPersonsLandmarks) {
  LandmarkFile file;
  for (const char* site : {"g", "n", "pg"}) {
    Landmark& landmark = file.landmarks.emplace_back();
    landmark.site = site;
    landmark.point = {9, 9, 9};
  }
  BenchState state = MarkAbsent(WithGlabella(), "pg", "gone");
  state = AddProposals(state, file);
  EXPECT_THAT(SiteCodes(state), ElementsAre("g", "n"));
  EXPECT_THAT(state.landmarks[0].point, ElementsAre(1, 2, 3));
  EXPECT_TRUE(state.landmarks[1].proposed);
  EXPECT_TRUE(ToLandmarkFile(state).proposed);
  EXPECT_FALSE(ToLandmarkFile(ConfirmAllLandmarks(state)).proposed);
  file.landmarks[1].point = {8, 8, 8};
  EXPECT_THAT(AddProposals(state, file).landmarks[1].point, ElementsAre(8, 8, 8))
      << "a proposal may be replaced by another";
}

LandmarkFile ProposedPoints(std::optional<double> doubt_of_n_mm) {
  LandmarkFile file;
  file.proposed = true;
  for (const char* site : {"g", "n"}) {
    Landmark& landmark = file.landmarks.emplace_back();
    landmark.site = site;
    landmark.point = {9, 9, 9};
    landmark.note = "proposed";
    landmark.doubt_mm = 2;
  }
  file.landmarks[1].doubt_mm = doubt_of_n_mm;
  return file;
}

TEST(BenchActions, AMovedProposalIsAPersonsLandmark) {
  const BenchState state = PlaceLandmark(ReplaceLandmarks({}, ProposedPoints(8)), "n", {1, 2, 3});
  EXPECT_TRUE(state.landmarks[0].proposed);
  EXPECT_FALSE(state.landmarks[1].proposed);
  EXPECT_FALSE(state.landmarks[1].doubt_mm);
  EXPECT_EQ(state.landmarks[1].note, "") << "the note explained the former point";
}

TEST(BenchActions, AllAreConfirmedOnlyAfterTheDoubtfulOnes) {
  BenchState state = ReplaceLandmarks({}, ProposedPoints(8));
  EXPECT_THROW(ConfirmAllLandmarks(state), InputError);
  state = ConfirmAllLandmarks(ConfirmLandmark(std::move(state), "n"));
  EXPECT_FALSE(ToLandmarkFile(state).proposed);
}

TEST(BenchActions, DoubtfulProposalsAreLeftOutAndTheOthersConfirmed) {
  BenchState state = LeaveOutDoubtfulLandmarks(ReplaceLandmarks({}, ProposedPoints(8)));
  ASSERT_EQ(state.landmarks.size(), 1U);
  EXPECT_EQ(state.landmarks[0].site, "g");
  EXPECT_FALSE(state.landmarks[0].proposed);
  ASSERT_EQ(state.absent.size(), 1U);
  EXPECT_EQ(state.absent[0].site, "n");
  state = LeaveOutDoubtfulLandmarks(
      PlaceLandmark(ReplaceLandmarks({}, ProposedPoints(8)), "n", {1, 2, 3}));
  EXPECT_EQ(state.landmarks.size(), 2U) << "a person's landmark has no doubt";
}

TEST(BenchActions, InAFileOfBothKindsOnlyPointsWithADoubtAreProposed) {
  const BenchState state = ReplaceLandmarks({}, ProposedPoints(std::nullopt));
  EXPECT_TRUE(state.landmarks[0].proposed);
  EXPECT_FALSE(state.landmarks[1].proposed);
}

TEST(BenchActions, ASettingReplacesItselfAndTheOptionsBelowIt) {
  BenchState state = ChangeSetting({}, "interp.type", "\"kriging\"");
  state = ChangeSetting(state, "interp.nugget_mm", "0.1");
  state = ChangeSetting(state, "interp.nugget_mm", "0.2");
  EXPECT_THAT(SettingTexts(state), ElementsAre("interp.type=\"kriging\"", "interp.nugget_mm=0.2"));
  state = ChangeSetting(state, "interp.type", "\"mean\"");
  EXPECT_THAT(SettingTexts(state), ElementsAre("interp.type=\"mean\""));
  state =
      ChangeSetting(state, "interpolate", "1");  // has the same beginning, but is another option
  EXPECT_THAT(SettingTexts(DropSetting(state, "interp")), ElementsAre("interpolate=1"));
}

TEST(BenchActions, InvalidArgumentsAreRefused) {
  EXPECT_THROW(PlaceLandmark({}, "nowhere", {0, 0, 0}), InputError);
  EXPECT_THROW(PlaceLandmark({}, "g", {kNaN, 0, 0}), InputError);
  EXPECT_THROW(RemoveLandmark({}, "g"), InputError);
  EXPECT_THROW(RenameLandmark(WithGlabella(), "g", "glabella?"), InputError);
  EXPECT_THROW(ChangeSetting({}, "", "1"), InputError);
  EXPECT_THROW(ChangeSetting({}, "title", "a\nb"), InputError);
  EXPECT_THROW(RemarkLandmark(WithGlabella(), "g",
                              {.certainty = {}, .note = {}, .depth_along_normal_mm = -1}),
               InputError);
}

TEST(BenchHistory, UndoAndRedoMoveAlongOneList) {
  BenchHistory history = BeginHistory({});
  EXPECT_FALSE(CanUndo(history));
  history = AddStep(history, "placed g", WithGlabella());
  history = AddStep(history, "removed g", RemoveLandmark(CurrentState(history), "g"));
  EXPECT_THAT(SiteCodes(CurrentState(Undone(history))), ElementsAre("g"));
  EXPECT_THAT(SiteCodes(CurrentState(Undone(Undone(history)))), IsEmpty());
  EXPECT_THAT(SiteCodes(CurrentState(Redone(Undone(history)))), IsEmpty());
  EXPECT_FALSE(CanRedo(history));
  const BenchHistory other = AddStep(Undone(history), "called", MarkAbsent({}, "g", ""));
  EXPECT_FALSE(CanRedo(other)) << "a new step drops the undone steps";
  EXPECT_EQ(other.steps.size(), 3u);
}

TEST(BenchHistory, OldStepsAreDropped) {
  BenchHistory history = BeginHistory({});
  for (int k = 0; k < 3 * kMaxHistorySteps; ++k) {
    history = AddStep(history, "placed", PlaceLandmark({}, "g", {double(k), 0, 0}));
  }
  EXPECT_THAT(history.steps, SizeIs(kMaxHistorySteps));
  EXPECT_EQ(CurrentState(history).landmarks[0].point[0], 3 * kMaxHistorySteps - 1);
}

// Regression test: each step held all edits, and a hundred pulls exceeded the size limit of a
// configuration file.
TEST(BenchHistory, AHundredPullsHaveAShortTextThatIsReadBack) {
  BenchHistory history = BeginHistory(WithGlabella());
  EditScript edits;
  std::size_t total = 0;
  for (int k = 0; k < kMaxHistorySteps + 20; ++k) {
    if (k % 10 == 9) {
      VertexEdit changed = edits.edits[1];
      changed.offset = std::array{0.5, 0.25, double(k)};
      edits.edits.erase(edits.edits.begin(), edits.edits.begin() + 2);
      edits.edits.push_back(changed);
    }
    for (int i = 0; i < 20; ++i) {
      edits.edits.push_back({2, k, i, std::array{0.1 * k, 1.0 / (1 + i), 0.3}});
    }
    total += edits.edits.size();
    history = AddStep(history, "pulled", ReplaceEdits(CurrentState(history), edits));
  }
  const std::string text = HistoryText(history);
  EXPECT_LT(text.size(), 5 * total) << "bytes; a whole edit takes about sixty";
  const BenchHistory again = HistoryFromText(text, "history");
  EXPECT_EQ(HistoryText(again), text);
  for (std::size_t k = 0; k < history.steps.size(); k += 11) {
    EXPECT_EQ(WriteConfig(again.steps[k].state), WriteConfig(history.steps[k].state)) << k;
  }
}

// The format of the first workbenches.
TEST(BenchHistory, StepsWithWholeEditsAreRead) {
  const BenchHistory history = HistoryFromText(
      "now: 1\nsteps:\n  - {what: began}\n"
      "  - {what: pulled, state: {edits: {edits: [{level: 1, i: 2, j: 3, offset: [1, 2, 3]}]}}}\n",
      "history");
  EXPECT_THAT(CurrentState(history).edits.edits, SizeIs(1));
}

TEST(BenchActions, ALongNoteIsRefused) {
  EXPECT_THROW(RemarkLandmark(WithGlabella(), "g", {.note = std::string(kMaxNote_bytes + 1, 'x')}),
               InputError);
}

TEST(BenchHistory, TheTextIsReadBackToTheSameHistory) {
  BenchState state = RemarkLandmark(PlaceLandmark({}, "zy_l", {0.1, -1e-17, 1.0 / 3}), "zy_l",
                                    {.certainty = Certainty::kLow,
                                     .note = "\"quoted\": #no comment\t\xC3\xA4",
                                     .depth_along_normal_mm = 12.25});
  state = ChangeSetting(MarkAbsent(state, "me", "[gone]"), "title", "\"a: b # c\"");
  state.edits.edits.push_back({2, 3, 4, std::array{0.1, 0.2, 0.3}});
  state.edits.edits.push_back({1, 3, 4, std::nullopt});
  const BenchHistory history = Undone(AddStep(BeginHistory(state), "what: ever", WithGlabella()));
  const std::string text = HistoryText(history);
  const BenchHistory again = HistoryFromText(text, "history");
  EXPECT_EQ(HistoryText(again), text);
  EXPECT_EQ(CurrentState(again).landmarks[0].point, state.landmarks[0].point);
  EXPECT_EQ(CurrentState(again).landmarks[0].note, state.landmarks[0].note);
  EXPECT_EQ(again.now, 0);
  EXPECT_THROW(HistoryFromText("{now: 3, steps: [{what: a}]}", "history"), ConfigError);
  EXPECT_THROW(HistoryFromText("{now: 0, steps: []}", "history"), ConfigError);
  EXPECT_THROW(HistoryFromText("{now: 0", "history"), ConfigError);
}

}  // namespace
}  // namespace semblance::problems
