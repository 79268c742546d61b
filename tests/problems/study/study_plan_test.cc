// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_plan.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "problems/study/study_file.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::ScratchFolder;
using testing::WordsOf;

const std::string kPlanBase = fmt::format(
    "base: {}/configs/phantom.yaml\n"
    "set: {{subject.rings: 40, implicit.resolution: 20, seeds.level: 0, template.max_level: 1,\n"
    "      fit.plan.schedule: [{{level: 0, fraction: 1}}], first_fit: []}}\n",
    SEMBLANCE_SOURCE_DIR);

class StudyPlanTest : public ::testing::Test {
 protected:
  fs::path Write(const std::string& text) {
    const fs::path file = folder_ / "study.yaml";
    WriteFileAtomically(file, text);
    return file;
  }
  StudyPlan Plan(const std::string& text) { return ReadStudy(Write(kPlanBase + text)); }
  std::string Faults(const std::string& text) {
    return WordsOf<ConfigError>([&] { Plan(text); });
  }

  static const SeedOptions& Seeds(const StudyTrial& trial) {
    return std::get<SeedOptions>(trial.experiment.seeds);
  }

  ScratchFolder folder_;
};

TEST_F(StudyPlanTest, EveryCombinationIsOneTrial) {
  const StudyPlan plan = Plan(
      "subjects: [{name: a}, {name: b, set: {subject.random_seed: 7}}]\n"
      "grid: {interp: [nearest, mean], rounds: [1, 2, 3]}\n"
      "zip: {seeds.weight: [0.5, 1.5], title: [x, y]}\n"
      "list: [{seeds.level: 0}, {fit.features: free}]\n");
  EXPECT_EQ(plan.trials.size(), 2u * 6 * 2 * 2);
  EXPECT_THAT(plan.axes, ElementsAre("interp", "rounds", "seeds.weight", "title", "seeds.level",
                                     "fit.features"));
  std::set<std::string> ids;
  for (const StudyTrial& trial : plan.trials) {
    ids.insert(trial.id);
    EXPECT_EQ(Seeds(trial).weight == 0.5, trial.experiment.title == "x");
  }
  EXPECT_EQ(ids.size(), plan.trials.size());
  EXPECT_THAT(plan.trials[0].values, ElementsAre("nearest", "1", "0.5", "x", "0", ""));
  EXPECT_EQ(plan.hash, Plan("subjects: [{name: a}, {name: b, set: {subject.random_seed: 7}}]\n"
                            "grid: {interp: [nearest, mean], rounds: [1, 2, 3]}\n"
                            "zip: {seeds.weight: [0.5, 1.5], title: [x, y]}\n"
                            "list: [{seeds.level: 0}, {fit.features: free}]\n")
                           .hash);
}

// The second value of an option would win, and the table would still show the first.
TEST_F(StudyPlanTest, AnOptionThatARowSetsTwiceIsRefused) {
  struct Twice {
    std::string text, place;
  };
  const std::vector<Twice> cases = {
      {"grid: {interp: [nearest, mean]}\nzip: {interp: [nearest, mean]}\n",
       ":5:7: interp: sets the same option as 'interp' in line 4; take one of them out"},
      {"grid: {rounds: [1, 2]}\nlist: [{rounds: 3}]\n", ":5:9: rounds: sets the same option"},
      {"grid: {seeds.level: [0, 1]}\nsample: {n: 2, ranges: {seeds.level: [0, 3]}}\n",
       ":5:25: seeds.level: sets the same option"},
      {"grid: {interp: [nearest, mean], interp.type: [mean, nearest]}\n",
       ":4:33: interp.type: sets the same option as 'interp'"},
      {"grid: {seeds: [{level: 0}, {weight: 2}], seeds.weight: [1, 3]}\n",
       ":4:42: seeds.weight: sets the same option as 'seeds'"},
      {"grid: {seeds.weight: [1, 3], seeds: [{level: 0}, {weight: 2}]}\n",
       ":4:30: seeds: sets the same option as 'seeds.weight'"},
      {"grid: {interp.power: [1, 2], interp: [nearest, mean]}\n",
       ":4:30: interp: sets the same option as 'interp.power'"},
      {"grid: {'fit.plan.schedule[0].fraction': [0.5, 1], 'fit.plan.schedule[00].fraction': [1]}\n",
       ":4:51: fit.plan.schedule[00].fraction: sets the same option"}};
  for (const Twice& twice : cases) {
    EXPECT_THAT(Faults(twice.text), HasSubstr(twice.place)) << twice.text;
  }
  // Different options of one strategy are no conflict, nor are rows of a list.
  EXPECT_EQ(Plan("grid: {seeds: [{level: 0}, {level: 1}], seeds.weight: [1, 3]}\n").trials.size(),
            4u);
  EXPECT_EQ(Plan("list: [{rounds: 1}, {rounds: 2}]\n").trials.size(), 2u);
}

TEST_F(StudyPlanTest, NamesThatAreTheSameInUnicodeAreTheSameSubject) {
  EXPECT_THAT(Faults("subjects: [{name: \"M\u00fcller\"}, {name: \"Mu\u0308ller\"}]\n"),
              HasSubstr("appears twice"));
  const StudyPlan plan = Plan(
      "subjects: [{name: \"Mu\u0308ller\"}, {name: b, set: "
      "{subject.random_seed: 7}}]\n");
  EXPECT_EQ(plan.trials[0].subject, "M\u00fcller");
  EXPECT_THAT(SelectTrials(plan, "subject = 'Mu\u0308ller'"), ElementsAre(true, false));
}

TEST_F(StudyPlanTest, TrialsAreCountedBeforeTheyAreMade) {
  std::string values = "[1";
  for (int k = 2; k <= 500; ++k) {
    values += fmt::format(", {}", k);
  }
  EXPECT_THAT(Faults(fmt::format("grid: {{subject.random_seed: {0}], rounds: {0}], "
                                 "implicit.resolution: {0}], seeds.level: {0}]}}\n",
                                 values)),
              HasSubstr("make 6.25e+10 trials; a study has at most 100000"));
}

TEST_F(StudyPlanTest, SamplesStayInTheirRangesAndFillThem) {
  const StudyPlan plan = Plan(
      "sample: {method: lhs, n: 10, random_seed: 3, ranges: {seeds.weight: [1.0, 2.0], rounds: [1, "
      "5]}}\n");
  ASSERT_EQ(plan.trials.size(), 10u);
  std::set<int> slices;
  for (const StudyTrial& trial : plan.trials) {
    slices.insert(static_cast<int>(10 * (Seeds(trial).weight - 1)));
    EXPECT_GE(trial.experiment.rounds, 1);
    EXPECT_LE(trial.experiment.rounds, 5);
  }
  EXPECT_EQ(slices.size(), 10u);  // one in each tenth
}

TEST_F(StudyPlanTest, SobolSamplesAreEvenInEachHalfOfARange) {
  const StudyPlan plan = Plan(
      "sample: {method: sobol, n: 15, ranges: {seeds.weight: [1.0, 2.0], rounds: [1, "
      "5]}}\n");
  ASSERT_EQ(plan.trials.size(), 15u);
  const Experiment& first = plan.trials[0].experiment;
  EXPECT_NEAR(std::get<SeedOptions>(first.seeds).weight, 1.5, 1e-12);
  int low = 0;
  for (const StudyTrial& trial : plan.trials) {
    low += Seeds(trial).weight < 1.5 ? 1 : 0;
  }
  EXPECT_EQ(low, 7);
}

TEST_F(StudyPlanTest, EveryFaultIsReportedOnceWithItsLine) {
  EXPECT_THAT(Faults("subjects: [{name: a}, {name: b}]\ngrid:\n  interp: [nearest, krigging]\n"),
              AllOf(HasSubstr("study.yaml:6:21: interp"), HasSubstr("krigging")));
  const std::string twice = Faults(
      "subjects: [{name: a}, {name: b, set: {subject.random_seed: 2}}]\n"
      "grid: {rounds: [1, 2000]}\n");
  EXPECT_EQ(std::count(twice.begin(), twice.end(), '\n'), 0) << twice;
  EXPECT_THAT(Faults("grids: {}\n"), HasSubstr("did you mean 'grid'?"));
  EXPECT_THAT(Faults("grid: {interp: nearest}\n"), HasSubstr("grid.interp: expected a list"));
  EXPECT_THAT(Faults("zip: {rounds: [1, 2], title: [a]}\n"), HasSubstr("have the same length"));
  EXPECT_THAT(Faults("sample: {n: 2, ranges: {rounds: [5, 1]}}\n"),
              HasSubstr("must be lower than"));
  EXPECT_THAT(Faults("subjects: [{name: a}, {name: a}]\n"),
              HasSubstr("the name 'a' appears twice"));
  EXPECT_THAT(Faults("grid: {rounds: [2, 2]}\n"), HasSubstr("are the same experiment"));
  EXPECT_THAT(Faults("grid: {no.such: [2]}\n"), HasSubstr("no"));
  EXPECT_THAT(WordsOf<ConfigError>([&] { ReadStudy(Write("grid: {rounds: [1]}\n")); }),
              HasSubstr("base: the file of an experiment is missing"));
}

// Beside this test, that of input_contents.h goes over every option.
TEST_F(StudyPlanTest, AnIdFollowsTheContentsOfFilesAndNotTheirPaths) {
  const auto id_in = [&](const std::string& place, const std::string& landmarks) {
    fs::create_directories(folder_ / place / "ct");
    WriteFileAtomically(folder_ / place / "ct/1.dcm", "slice");
    WriteFileAtomically(folder_ / place / "ct_landmarks.yaml", landmarks);
    WriteFileAtomically(folder_ / place / "network.yaml", "areas");
    WriteFileAtomically(
        folder_ / place / "e.yaml",
        "subject: {type: ct, volume: ct, landmarks: ct_landmarks.yaml}\n"
        "tissue: {depths: measured, table: not_used.yaml}\nnetwork: network.yaml\n");
    WriteFileAtomically(folder_ / place / "s.yaml", "base: e.yaml\ngrid: {interp: [nearest]}\n");
    return ReadStudy(folder_ / place / "s.yaml").trials.at(0).id;
  };
  const std::string id = id_in("here", "10 mm");
  EXPECT_EQ(id_in("another machine", "10 mm"), id);
  EXPECT_NE(id_in("here", "20 mm"), id);
  EXPECT_EQ(id_in("here", "10 mm"), id);
  fs::rename(folder_ / "here/ct", folder_ / "here/scan");
  WriteFileAtomically(folder_ / "here/e2.yaml", "base: e.yaml\nsubject: {volume: scan}\n");
  WriteFileAtomically(folder_ / "here/s2.yaml", "base: e2.yaml\ngrid: {interp: [nearest]}\n");
  EXPECT_EQ(ReadStudy(folder_ / "here/s2.yaml").trials.at(0).id, id) << "only renamed";
}

// Two names of one treatment would otherwise run twice and compete with each other.
TEST_F(StudyPlanTest, AnIdDoesNotFollowTheTitle) {
  const auto id = [&](const std::string& title) {
    return Plan(fmt::format("list: [{{title: {}, rounds: 2}}]\n", title)).trials.at(0).id;
  };
  EXPECT_EQ(id("two rounds"), id("again"));
  EXPECT_EQ(id("two rounds"), Plan("grid: {rounds: [2]}\n").trials.at(0).id);
  EXPECT_THAT(Faults("list: [{title: a, rounds: 2}, {title: b, rounds: 2}]\n"),
              HasSubstr("are the same experiment"));
}

TEST_F(StudyPlanTest, ASubjectWithMissingFilesIsSkippedIfOptionalElseAnError) {
  const std::string missing =
      "subjects: [{name: a}, {name: b, set: {subject: {type: files, skull: none.ply, landmarks: "
      "none.yaml}}";
  const StudyPlan plan = Plan(missing + ", optional: true}]\n");
  EXPECT_EQ(plan.trials.size(), 1u);
  EXPECT_THAT(plan.notes, ElementsAre(HasSubstr("subject b: skipped")));
  EXPECT_THAT(Faults(missing + "}]\n"), HasSubstr("subject b: no such file"));
}

TEST_F(StudyPlanTest, NoSubjectIsAFaultOrForCheckANote) {
  const std::string text =
      "subjects: [{name: b, optional: true, set: {subject: {type: files, skull: none.ply, "
      "landmarks: none.yaml}}}]\n";
  EXPECT_THAT(Faults(text), HasSubstr("study.yaml: no subject is left"));
  const StudyPlan plan = ReadStudy(Write(kPlanBase + text), WithoutSubjects::kNote);
  EXPECT_TRUE(plan.trials.empty());
  EXPECT_THAT(plan.notes,
              ElementsAre(HasSubstr("subject b: skipped"), HasSubstr("no subject is left")));
  EXPECT_THROW(
      ReadStudy(Write(kPlanBase + text + "grid: {rounds: [one]}\n"), WithoutSubjects::kNote),
      ConfigError);
}

TEST_F(StudyPlanTest, ASearchIsRefusedAndItsReplacementIsNamed) {
  EXPECT_EQ(Faults("subjects: [{name: a}]\nsearch: {budget: 4}\n"),
            (folder_ / "study.yaml").string() +
                ":5:9: search: removed in 1.0; use Optuna, as docs/examples/search_with_optuna.py "
                "does");
}

TEST_F(StudyPlanTest, TheStrictReaderReadsEveryPartOfTheFile) {
  EXPECT_THAT(
      Faults("keep: everything\njob: [face]\n"),
      AllOf(HasSubstr("study.yaml:4:7: keep: unknown word 'everything'; known are: summary, "
                      "view, run"),
            HasSubstr("study.yaml:5:6: job: expected a word, found a list")));
  EXPECT_THAT(Faults("subjects: [{nam: a}]\n"),
              HasSubstr("study.yaml:4:13: subjects[0].nam: unknown key; did you mean 'name'?"));
  EXPECT_THAT(Faults("subjects: []\n"), HasSubstr("subjects: expected a list of at least 1"));
  EXPECT_THAT(Faults("sample: {method: halton, n: 0, ranges: {rounds: [1, 5, 9]}}\n"),
              AllOf(HasSubstr("sample.method: unknown word 'halton'"),
                    HasSubstr("sample.n: 0 is out of range; allowed is 1 to 100000"),
                    HasSubstr("sample.ranges.rounds: expected a list of 2, found 3")));
  EXPECT_THAT(Faults("sample: {method: lhs}\n"),
              AllOf(HasSubstr("sample.n: the number of samples is missing"),
                    HasSubstr("sample.ranges: there is no range")));
  EXPECT_THAT(Faults("set: {rounds: 2}\n"),
              HasSubstr("study.yaml:4:1: set: the key appears twice"));
}

TEST_F(StudyPlanTest, FaultsOfKeepMetricAndAxesAreReportedTogetherAndOnce) {
  const std::string words = Faults(
      "subjects: [{name: a}, {name: b, set: {subject.random_seed: 2}}]\n"
      "grid:\n  interp: [nearest, krigging]\n  rounds: [1, 2000]\nkeep: all\nmetric: "
      "face.rms\n");
  EXPECT_THAT(words, AllOf(HasSubstr("keep: unknown word 'all'"),
                           HasSubstr("metric: no trial of job: face has a number 'face.rms'; did "
                                     "you mean 'face.rms_mm'?"),
                           HasSubstr("krigging"), HasSubstr("rounds: 2000 is out of range")));
  EXPECT_EQ(std::count(words.begin(), words.end(), '\n'), 3) << words;
}

TEST_F(StudyPlanTest, TheJobAndTheSubjectsMustHaveTheMetric) {
  EXPECT_THAT(Faults("metric: face.rms_mm\njob: depth\n"), HasSubstr("no trial of job: depth"));
  EXPECT_NO_THROW(Plan("metric: cross_validation.landmark.sites.g\njob: depth\n"));
  EXPECT_NO_THROW(Plan("metric: cross_validation.side.sites.go_l\njob: depth\n"));
  EXPECT_THAT(Faults("metric: cross_validation.landmark.sites.go\njob: depth\n"),
              HasSubstr("'go' is a paired site; write go_l or go_r"));
  EXPECT_THAT(Faults("metric: cross_validation.foo.sites.g\njob: depth\n"),
              HasSubstr("no trial of job: depth"));
  for (const char* metric : {"depth.process.length_mm", "depth.shares.kriging",
                             "\"depth.shares.kriging matern_5_2\"", "depth.shares.radial_basis"}) {
    EXPECT_NO_THROW(Plan(fmt::format("metric: {}\njob: depth\n", metric))) << metric;
  }
  EXPECT_THAT(Faults("metric: depth.shares.krigin\njob: depth\n"),
              HasSubstr("did you mean 'depth.shares.kriging'?"));
  EXPECT_THAT(Faults("metric: depth.shares.krigin matern_5_2\njob: depth\n"),
              HasSubstr("no trial of job: depth"));
  EXPECT_NO_THROW(Plan("metric: identify.surface.rank\njob: identify\n"));
  WriteFileAtomically(folder_ / "skull.ply", "");
  WriteFileAtomically(folder_ / "marks.yaml", "");
  EXPECT_THAT(Faults("subjects: [{name: a, set: {subject: {type: files, skull: skull.ply, "
                     "landmarks: marks.yaml}}}]\n"),
              HasSubstr("measured against the true skin, which no subject has"));
}

TEST_F(StudyPlanTest, AConditionSelectsTrialsBySubjectTagAndAxes) {
  const StudyPlan plan = Plan(
      "subjects: [{name: a, tags: [odd]}, {name: b, tags: [even, big], set: {subject.random_seed: "
      "7}}]\ngrid: {interp: [nearest, mean], rounds: [1, 2, 10]}\n");
  const auto count = [&](const std::string& condition) {
    const std::vector<bool> chosen = SelectTrials(plan, condition);
    return std::count(chosen.begin(), chosen.end(), true);
  };
  EXPECT_EQ(count(""), 12);
  EXPECT_EQ(count("tag = big"), 6);
  EXPECT_EQ(count("tag != big and interp = mean"), 3);
  EXPECT_EQ(count("rounds >= 2"), 8);
  EXPECT_EQ(count("id = " + plan.trials[3].id), 1);
}

TEST_F(StudyPlanTest, EachTypeOfAnAxisHasItsOwnDefaults) {
  const StudyPlan plan = Plan("grid: {interp.type: [network_spline, natural_neighbour]}\n");
  ASSERT_EQ(plan.trials.size(), 2u);
  EXPECT_TRUE(std::holds_alternative<NaturalNeighbour>(plan.trials[1].experiment.interp));
  EXPECT_THAT(Faults("grid: {interp.type: [natural_neighbour], interp.distance: [geodesic]}\n"),
              HasSubstr("interp.distance: unknown key"));
}

}  // namespace
}  // namespace semblance::problems
