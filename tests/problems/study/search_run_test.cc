// SPDX-License-Identifier: GPL-3.0-or-later
// Searches from file to tables, on phantoms coarse enough to be quick.
#include "problems/study/search_run.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "problems/study/study_run.h"
#include "problems/study_report/search_report.h"
#include "problems/study_report/study_ranking.h"
#include "problems/study_report/study_report.h"
#include "surfaces/base/atomic_file.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"
#include "tests/testing/study_files.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::ScratchFolder;
using testing::StudyFiles;
using testing::WordsOf;

const std::string kBase = fmt::format(
    "base: {}/configs/phantom.yaml\n"
    "set: {{subject.rings: 20, interp: {{type: kriging, length_mm: 20}}}}\n"
    "subjects: [{{name: a}}, {{name: b, set: {{subject.random_seed: 2}}}}]\n"
    "job: depth\nmetric: depth_truth.along_direction.rms_mm\n",
    SEMBLANCE_SOURCE_DIR);
const std::string kAxes =
    "  ranges: {interp.length_mm: {low: 5.0, high: 200.0, log: true}}\n"
    "  choices: {interp.covariance: [matern_1_2, matern_5_2]}\n";
const std::string kBayes = "search:\n  method: {type: bayes, initial: 3}\n  budget: 6\n" + kAxes +
                           "  held_out: [{name: c, set: {subject.random_seed: 3}}]\n";

class SearchRunTest : public ::testing::Test {
 protected:
  StudyPlan Plan(const std::string& text) {
    const fs::path file = folder_ / "study.yaml";
    WriteFileAtomically(file, kBase + text);
    return ReadStudy(file);
  }
  std::string Faults(const std::string& text) {
    return WordsOf<ConfigError>([&] { Plan(text); });
  }
  static SearchResults Results(const fs::path& root) {
    return ReadSearchResults(root, ReadStudyResults(root)).value();
  }

  ScratchFolder folder_;
};

TEST_F(SearchRunTest, SameBytesForAnyJobsShardsAndInterruptions) {
  const StudyPlan plan = Plan(kBayes);
  RunStudy(plan, folder_ / "one", {}, {});
  const auto one = StudyFiles(folder_ / "one");
  const SearchResults found = Results(folder_ / "one");
  EXPECT_TRUE(found.ended);
  EXPECT_EQ(found.treatments.size(), 6u);
  EXPECT_THAT(one.at("report.html"), HasSubstr("best so far"));

  RunStudy(plan, folder_ / "two", {.jobs = 2}, {});
  EXPECT_EQ(StudyFiles(folder_ / "two"), one);

  // Each shard goes as far as it can without the other.
  int calls = 0;
  for (bool waits = true; waits && calls < 20; ++calls) {
    waits = RunStudy(plan, folder_ / "shards", {.shard = calls % 2, .shards = 2}, {}).waits;
  }
  EXPECT_GT(calls, 2);
  EXPECT_LT(calls, 20);
  EXPECT_EQ(StudyFiles(folder_ / "shards"), one);

  // As if killed: of a search that has ended some trials are gone or cut short, its plan too.
  const StudyResults results = ReadStudyResults(folder_ / "one");
  for (const std::size_t n : {std::size_t{2}, results.trials.size() - 1}) {
    fs::remove_all(folder_ / "one" / "trials" / results.trials[n].id);
  }
  WriteFileAtomically(folder_ / "one" / "trials" / results.trials[6].id / "trial.json", "{\"id\"");
  fs::remove(folder_ / "one" / "plan.json");
  EXPECT_EQ(RunStudy(plan, folder_ / "one", {}, {}).done, 3);
  EXPECT_EQ(StudyFiles(folder_ / "one"), one);
}

// Six treatments and the base on two subjects, the best and the base on one held out: 16 trials.
TEST_F(SearchRunTest, ProgressCountsWhatWillStillBeAskedFor) {
  for (const int shards : {1, 2}) {
    std::vector<StudyEta> told;
    StudyRunOptions options{.shards = shards};
    options.on_progress = [&told](const StudyEta& eta, const std::string&) { told.push_back(eta); };
    const StudySummary end =
        RunStudy(Plan(kBayes), folder_ / fmt::format("{}", shards), options, {});
    ASSERT_FALSE(told.empty());
    EXPECT_NEAR(told.front().trials + told.front().later, 16.0 / shards, 1);
    if (shards == 1) {
      EXPECT_EQ(told.back().trials, 16);
      EXPECT_EQ(told.back().later, 0);
      EXPECT_FALSE(end.waits);
    } else {
      EXPECT_GT(told.back().later, 0) << "it waits for the other shard";
    }
    const auto is_early = [&told](const StudyEta& eta) {
      return eta.finished == eta.trials + eta.later && eta.finished < told.back().finished;
    };
    EXPECT_EQ(std::ranges::count_if(told, is_early), 0) << "said to be over before it was";
  }
}

TEST_F(SearchRunTest, ALargerBudgetGoesOn) {
  const auto with_budget = [](int budget) {
    return fmt::format("search:\n  method: {{type: bayes, initial: 3}}\n  budget: {}\n{}", budget,
                       kAxes);
  };
  RunStudy(Plan(with_budget(3)), folder_ / "run", {}, {});
  const StudySummary on = RunStudy(Plan(with_budget(5)), folder_ / "run", {}, {});
  EXPECT_EQ(on.skipped, 2 + 2 * 3);  // the base and three treatments, on two subjects
  EXPECT_EQ(on.done, 2 * 2);
  EXPECT_EQ(on.left_over, 0);
  RunStudy(Plan(with_budget(5)), folder_ / "new", {}, {});
  EXPECT_EQ(StudyFiles(folder_ / "run"), StudyFiles(folder_ / "new"));
}

TEST_F(SearchRunTest, TheBestIsTheBestOfWhatWasTriedEitherWayRound) {
  for (const bool higher : {false, true}) {
    const fs::path root = folder_ / (higher ? "higher" : "lower");
    RunStudy(Plan("search:\n  method: random\n  budget: 5\n  better: " +
                  std::string(higher ? "higher\n" : "lower\n") + kAxes),
             root, {}, {});
    const SearchResults found = Results(root);
    ASSERT_FALSE(found.improvements.empty());
    const double best = found.treatments[found.improvements.back()].value;
    for (const SearchedTreatment& treatment : found.treatments) {
      EXPECT_TRUE(higher ? treatment.value <= best : treatment.value >= best);
    }
    EXPECT_THAT(SearchText(ReadStudyResults(root), found),
                HasSubstr(higher ? "higher values" : "lower values"));
  }
}

// Four choices drawn eight times are four treatments.
TEST_F(SearchRunTest, DrawsOfTheSameTreatmentAreNotTakenForOthers) {
  RunStudy(Plan("search:\n  method: random\n  budget: 8\n  choices: {interp.covariance: "
                "[matern_1_2, matern_5_2]}\n"),
           folder_ / "run", {}, {});
  const SearchResults found = Results(folder_ / "run");
  EXPECT_THAT(SearchText(ReadStudyResults(folder_ / "run"), found),
              HasSubstr("8 of 8 full runs spent on 8 draws, 2 different treatments;"));
}

// Of a signed error it is the size that counts, of each subject by itself.
TEST_F(SearchRunTest, ASignedErrorIsBestNearestToZero) {
  const std::string metric = "depth_truth.along_direction.mean_signed_mm";
  std::string text = kBase + "search:\n  method: random\n  budget: 5\n" + kAxes;
  const std::string other = "depth_truth.along_direction.rms_mm";
  text.replace(text.find(other), other.size(), metric);
  WriteFileAtomically(folder_ / "study.yaml", text);
  RunStudy(ReadStudy(folder_ / "study.yaml"), folder_ / "run", {}, {});
  const StudyResults results = ReadStudyResults(folder_ / "run");
  const SearchResults found = Results(folder_ / "run");
  ASSERT_FALSE(found.improvements.empty());
  const double best = found.treatments[found.improvements.back()].value;
  for (const Treatment& treatment : Treatments(results, metric)) {
    double off = 0;
    for (const auto& [subject, value] : treatment.by_subject) {
      off += std::abs(value) / static_cast<double>(treatment.by_subject.size());
    }
    if (treatment.label != "base") {
      EXPECT_GE(off, best - 1e-12);
    }
  }
  EXPECT_THAT(SearchText(results, found), HasSubstr("nearest to 0 are better"));
  EXPECT_THAT(RankingText(results), HasSubstr("nearest to 0 is better: by the mean distance"));
}

// The judge: what the search found and the base as it stands, on a subject that it never saw.
TEST_F(SearchRunTest, SubjectsHeldOutAreRunOnceWithTheBestAndTheBaseAndAreInNoRanking) {
  RunStudy(Plan(kBayes), folder_ / "run", {}, {});
  const StudyResults results = ReadStudyResults(folder_ / "run");
  const SearchResults found = Results(folder_ / "run");
  EXPECT_THAT(SearchText(results, found), HasSubstr("Searched by bayes (initial: 3, batch: 2): "));
  ASSERT_EQ(found.held_out.size(), 1u);
  EXPECT_EQ(found.held_out[0].subject, "c");
  EXPECT_TRUE(std::isfinite(found.held_out[0].base) && std::isfinite(found.held_out[0].best));
  int of_c = 0;
  for (const TrialRow& row : results.trials) {
    of_c += row.subject == "c" ? 1 : 0;
  }
  EXPECT_EQ(of_c, 2);
  for (const Treatment& treatment : Treatments(results, results.metric)) {
    EXPECT_FALSE(treatment.by_subject.contains("c"));
    EXPECT_EQ(treatment.by_subject.size(), 2u);
  }
}

TEST_F(SearchRunTest, ShortRunsOfHalvingTakeFewerStepsOfTheFitOrWhatIsAskedFor) {
  const std::string face = fmt::format(
      "base: {}/configs/phantom.yaml\nset: {{subject.rings: 20}}\n", SEMBLANCE_SOURCE_DIR);
  const auto plan_of = [&](const std::string& method) {
    const fs::path file = folder_ / "face.yaml";
    WriteFileAtomically(file,
                        face + "search:\n  method: " + method +
                            "\n  budget: 4\n  ranges: {seeds.weight: {low: 0.1, high: 1.0}}\n");
    return ReadStudy(file);
  };
  const auto steps_of = [](const StudyPlan& plan, int rung) {
    TrialFaults faults;
    const auto trials = TrialsAt(*plan.search, {{0.5}, rung}, plan.search->subjects, faults);
    EXPECT_EQ(trials.at(0).aside, rung < 2);
    EXPECT_EQ(trials.at(0).experiment.seeds.weight, 0.5);
    return StepsOf(trials.at(0).experiment.fit.plan).size();
  };
  const StudyPlan by_steps = plan_of("halving");
  EXPECT_THAT(by_steps.axes, ElementsAre("seeds.weight", "rung"));
  EXPECT_EQ(steps_of(by_steps, 0), 1u);  // of the six published ones
  EXPECT_EQ(steps_of(by_steps, 1), 2u);
  EXPECT_EQ(steps_of(by_steps, 2), 6u);
  const StudyPlan by_hand = plan_of(
      "{type: halving, short_runs: [{implicit.resolution: 20}, {implicit.resolution: 30}]}");
  TrialFaults faults;
  const auto trials = TrialsAt(*by_hand.search, {{0.5}, 1}, by_hand.search->subjects, faults);
  EXPECT_EQ(trials[0].experiment.implicit.resolution, 30);
  EXPECT_THAT(trials[0].values, ElementsAre("0.5", "2 of 3"));
  EXPECT_EQ(steps_of(by_hand, 0), 6u);
}

TEST_F(SearchRunTest, EveryFaultIsSaidAtItsPlaceBeforeAnythingRuns) {
  const std::string method = "search:\n  budget: 5\n";
  EXPECT_THAT(Faults("search: {ranges: {interp.length_mm: {low: 5.0, high: 9.0}}}\n"),
              HasSubstr("search.budget: the number of treatments is missing"));
  EXPECT_THAT(Faults(method), HasSubstr("there is nothing to search"));
  EXPECT_THAT(Faults(method + "  methods: bayes\n"), HasSubstr("did you mean 'method'"));
  EXPECT_THAT(Faults(method + kAxes + "grid: {rounds: [1, 2]}\n"),
              HasSubstr("search: chooses the treatments itself"));
  EXPECT_THAT(Faults(method + "  ranges: {interp.length_mm: {low: 9.0, high: 5.0}}\n"),
              HasSubstr("low must be lower than high"));
  EXPECT_THAT(Faults(method + "  ranges: {interp.length_mm: {low: 0.0, high: 5.0, log: true}}\n"),
              HasSubstr("both ends must be above 0"));
  EXPECT_THAT(Faults(method + "  ranges: {interp.length_mm: {low: 5.0}}\n"),
              HasSubstr("give both ends"));
  EXPECT_THAT(Faults(method + "  ranges: {interp.length_mm: {low: 5.0, high: 1e9}}\n"),
              AllOf(HasSubstr("interp.length_mm"), HasSubstr("out of range")));
  EXPECT_THAT(Faults(method + "  choices: {interp.covariance: [matern_1_2, matern_7_2]}\n"),
              HasSubstr("matern_7_2"));
  EXPECT_THAT(Faults(method + "  choices: {interp.covariance: [matern_1_2]}\n"),
              HasSubstr("search.choices.interp.covariance"));
  // An option of kriging beside a type that does not have it.
  EXPECT_THAT(Faults(method + "  ranges: {interp.length_mm: {low: 5.0, high: 9.0}}\n  choices: "
                              "{interp: [nearest, kriging]}\n"),
              HasSubstr("length_mm"));
  EXPECT_THAT(Faults(method + kAxes + "  method: halving\n"), HasSubstr("job: depth has none"));
  EXPECT_THAT(Faults(method + kAxes + "  method: {type: halving, short_runs: [{rounds: 1}]}\n"),
              HasSubstr("one for each rung but the last"));
  EXPECT_THAT(Faults(method + kAxes + "  held_out: [{name: a}]\n"),
              HasSubstr("'a' is one of the subjects already"));
  EXPECT_THAT(Faults(method + kAxes + "  metric: depth_truth.closest.rms_mm\n"),
              HasSubstr("a study has one"));
  EXPECT_THAT(Faults(method + kAxes + "  better: bigger\n"), HasSubstr("lower, higher"));
  const StudyPlan plan = Plan(kBayes);
  EXPECT_THAT(
      WordsOf<InputError>([&] { RunStudy(plan, folder_ / "no", {.only = "subject = a"}, {}); }),
      HasSubstr("a search decides itself"));
  EXPECT_FALSE(fs::exists(folder_ / "no"));
}

}  // namespace
}  // namespace semblance
