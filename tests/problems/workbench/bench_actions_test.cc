// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/workbench/bench_actions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/config/config.h"
#include "problems/workbench/bench_history.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

BenchState WithGlabella() { return PlaceLandmark({}, "g", {1, 2, 3}); }

std::vector<std::string> SitesOf(const BenchState& state) {
  std::vector<std::string> sites;
  for (const BenchLandmark& landmark : state.landmarks) {
    sites.push_back(landmark.site);
  }
  return sites;
}

std::vector<std::string> SettingsOf(const BenchState& state) {
  std::vector<std::string> settings;
  for (const BenchSetting& setting : state.settings) {
    settings.push_back(setting.path + "=" + setting.value);
  }
  return settings;
}

TEST(BenchActions, AMovedLandmarkKeepsWhatIsKnownOfItButItsNormal) {
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

TEST(BenchActions, ASiteIsPlacedOrAbsentAndNeverBoth) {
  const BenchState absent = CallAbsent(WithGlabella(), "g", "broken");
  EXPECT_THAT(absent.landmarks, IsEmpty());
  ASSERT_THAT(absent.absent, SizeIs(1));
  const BenchState placed = PlaceLandmark(absent, "g", {1, 2, 3});
  EXPECT_THAT(placed.absent, IsEmpty());
  EXPECT_THAT(SitesOf(placed), ElementsAre("g"));
}

TEST(BenchActions, RenamingToANameThatIsTakenExchangesTheTwo) {
  const BenchState two = PlaceLandmark(PlaceLandmark({}, "go_l", {1, 0, 0}), "go_r", {2, 0, 0});
  const BenchState swapped = RenameLandmark(two, "go_l", "go_r");
  EXPECT_THAT(SitesOf(swapped), ElementsAre("go_r", "go_l"));
  EXPECT_THAT(swapped.landmarks[0].point, ElementsAre(1, 0, 0));
}

TEST(BenchActions, ProposalsLeaveAPersonsLandmarksAlone) {
  LandmarkFile file;
  for (const char* site : {"g", "n", "pg"}) {
    Landmark& landmark = file.landmarks.emplace_back();
    landmark.site = site;
    landmark.point = {9, 9, 9};
  }
  BenchState state = CallAbsent(WithGlabella(), "pg", "gone");
  state = TakeProposals(state, file);
  EXPECT_THAT(SitesOf(state), ElementsAre("g", "n"));
  EXPECT_THAT(state.landmarks[0].point, ElementsAre(1, 2, 3));
  EXPECT_TRUE(state.landmarks[1].proposed);
  EXPECT_TRUE(LandmarksOf(state).proposed);
  EXPECT_FALSE(LandmarksOf(ConfirmAllLandmarks(state)).proposed);
  file.landmarks[1].point = {8, 8, 8};
  EXPECT_THAT(TakeProposals(state, file).landmarks[1].point, ElementsAre(8, 8, 8))
      << "a proposal may be proposed anew";
}

TEST(BenchActions, ASettingReplacesItselfAndWhatLiesBelow) {
  BenchState state = ChangeSetting({}, "interp.type", "\"kriging\"");
  state = ChangeSetting(state, "interp.nugget_mm", "0.1");
  state = ChangeSetting(state, "interp.nugget_mm", "0.2");
  EXPECT_THAT(SettingsOf(state), ElementsAre("interp.type=\"kriging\"", "interp.nugget_mm=0.2"));
  state = ChangeSetting(state, "interp.type", "\"mean\"");
  EXPECT_THAT(SettingsOf(state), ElementsAre("interp.type=\"mean\""));
  state = ChangeSetting(state, "interpolate", "1");  // begins alike, and lies elsewhere
  EXPECT_THAT(SettingsOf(DropSetting(state, "interp")), ElementsAre("interpolate=1"));
}

TEST(BenchActions, WhatCannotBeMeantIsRefused) {
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

TEST(BenchHistory, UndoAndRedoWalkAlongOneList) {
  BenchHistory history = BeginHistory({});
  EXPECT_FALSE(CanUndo(history));
  history = Done(history, "placed g", WithGlabella());
  history = Done(history, "removed g", RemoveLandmark(Now(history), "g"));
  EXPECT_THAT(SitesOf(Now(Undone(history))), ElementsAre("g"));
  EXPECT_THAT(SitesOf(Now(Undone(Undone(history)))), IsEmpty());
  EXPECT_THAT(SitesOf(Now(Redone(Undone(history)))), IsEmpty());
  EXPECT_FALSE(CanRedo(history));
  const BenchHistory other = Done(Undone(history), "called", CallAbsent({}, "g", ""));
  EXPECT_FALSE(CanRedo(other)) << "what was undone is forgotten once something else is done";
  EXPECT_EQ(other.steps.size(), 3u);
}

TEST(BenchHistory, OldStepsAreForgotten) {
  BenchHistory history = BeginHistory({});
  for (int k = 0; k < 3 * kMostSteps; ++k) {
    history = Done(history, "placed", PlaceLandmark({}, "g", {double(k), 0, 0}));
  }
  EXPECT_THAT(history.steps, SizeIs(kMostSteps));
  EXPECT_EQ(Now(history).landmarks[0].point[0], 3 * kMostSteps - 1);
}

// Each step once held all edits: a hundred pulls took more than a configuration may have.
TEST(BenchHistory, AHundredPullsAreShortAndComeBack) {
  BenchHistory history = BeginHistory(WithGlabella());
  EditScript edits;
  std::size_t in_all = 0;
  for (int k = 0; k < kMostSteps + 20; ++k) {
    if (k % 10 == 9) {
      VertexEdit changed = edits.edits[1];
      changed.offset = std::array{0.5, 0.25, double(k)};
      edits.edits.erase(edits.edits.begin(), edits.edits.begin() + 2);
      edits.edits.push_back(changed);
    }
    for (int i = 0; i < 20; ++i) {
      edits.edits.push_back({2, k, i, std::array{0.1 * k, 1.0 / (1 + i), 0.3}});
    }
    in_all += edits.edits.size();
    history = Done(history, "pulled", TakeEdits(Now(history), edits));
  }
  const std::string text = HistoryText(history);
  EXPECT_LT(text.size(), 5 * in_all) << "bytes; written whole an edit takes some sixty";
  const BenchHistory again = HistoryFromText(text, "history");
  EXPECT_EQ(HistoryText(again), text);
  for (std::size_t k = 0; k < history.steps.size(); k += 11) {
    EXPECT_EQ(WriteConfig(again.steps[k].state), WriteConfig(history.steps[k].state)) << k;
  }
}

// As the first workbenches wrote it.
TEST(BenchHistory, StepsThatHoldAllTheirEditsAreRead) {
  const BenchHistory history = HistoryFromText(
      "now: 1\nsteps:\n  - {what: began}\n"
      "  - {what: pulled, state: {edits: {edits: [{level: 1, i: 2, j: 3, offset: [1, 2, 3]}]}}}\n",
      "history");
  EXPECT_THAT(Now(history).edits.edits, SizeIs(1));
}

TEST(BenchActions, ALongNoteIsRefused) {
  EXPECT_THROW(RemarkLandmark(WithGlabella(), "g", {.note = std::string(kLongestNote + 1, 'x')}),
               InputError);
}

TEST(BenchHistory, ItsTextGivesItBack) {
  BenchState state = RemarkLandmark(PlaceLandmark({}, "zy_l", {0.1, -1e-17, 1.0 / 3}), "zy_l",
                                    {.certainty = Certainty::kLow,
                                     .note = "\"quoted\": #no comment\t\xC3\xA4",
                                     .depth_along_normal_mm = 12.25});
  state = ChangeSetting(CallAbsent(state, "me", "[gone]"), "title", "\"a: b # c\"");
  state.edits.edits.push_back({2, 3, 4, std::array{0.1, 0.2, 0.3}});
  state.edits.edits.push_back({1, 3, 4, std::nullopt});
  const BenchHistory history = Undone(Done(BeginHistory(state), "what: ever", WithGlabella()));
  const std::string text = HistoryText(history);
  const BenchHistory again = HistoryFromText(text, "history");
  EXPECT_EQ(HistoryText(again), text);
  EXPECT_EQ(Now(again).landmarks[0].point, state.landmarks[0].point);
  EXPECT_EQ(Now(again).landmarks[0].note, state.landmarks[0].note);
  EXPECT_EQ(again.now, 0);
  EXPECT_THROW(HistoryFromText("{now: 3, steps: [{what: a}]}", "history"), ConfigError);
  EXPECT_THROW(HistoryFromText("{now: 0, steps: []}", "history"), ConfigError);
  EXPECT_THROW(HistoryFromText("{now: 0", "history"), ConfigError);
}

}  // namespace
}  // namespace semblance
