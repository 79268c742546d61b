// SPDX-License-Identifier: GPL-3.0-or-later
// Studies from file to tables, on phantoms coarse enough to be quick.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "problems/config/config.h"
#include "problems/run.h"
#include "problems/study/report/study_comparison.h"
#include "problems/study/report/study_report.h"
#include "problems/study/study_metrics.h"
#include "problems/study/study_run.h"
#include "surfaces/base/atomic_file.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"
#include "tests/testing/study_files.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ScratchFolder;
using testing::StudyFiles;
using testing::WordsOf;

const std::string kBase = fmt::format(
    "base: {}/configs/phantom.yaml\n"
    "set: {{subject.rings: 16, implicit.resolution: 16, seeds.level: 0, template.max_level: 1,\n"
    "      fit.plan.schedule: [{{level: 0, fraction: 1}}], first_fit: []}}\n",
    SEMBLANCE_SOURCE_DIR);

const char* const kSmall =
    "subjects:\n  - {name: a, set: {subject.random_seed: 1}}\n"
    "  - {name: b, set: {subject.random_seed: 2}}\n"
    "grid: {interp: [nearest, {type: mean}], fit.features: [restore]}\nmetric: "
    "implicit_face.rms_mm\n";

class StudyTest : public ::testing::Test {
 protected:
  fs::path Write(const std::string& text) {
    const fs::path file = folder_ / "study.yaml";
    WriteFileAtomically(file, text);
    return file;
  }
  StudyPlan Plan(const std::string& text) { return ReadStudy(Write(kBase + text)); }

  // Puts a finished study of kSmall into the folder. Its trials run once per process.
  void CopySmall(const std::string& folder) {
    static const ScratchFolder done("_small");
    if (!fs::exists(done / "run")) {
      RunStudy(Plan(kSmall), done / "run", {}, {});
    }
    fs::copy(done / "run", folder_ / folder, fs::copy_options::recursive);
  }

  ScratchFolder folder_;
};

TEST_F(StudyTest, SameBytesForAnyJobsShardsAndInterruptionsThorough) {
  const StudyPlan plan = Plan(kSmall);
  CopySmall("one");
  const auto one = StudyFiles(folder_ / "one");
  EXPECT_THAT(one.at("trials.csv"), HasSubstr(",implicit_face.rms_mm,"));

  RunStudy(plan, folder_ / "shard0", {.jobs = 2, .shard = 0, .shards = 2}, {});
  RunStudy(plan, folder_ / "shard1", {.shard = 1, .shards = 2}, {});
  GatherTrials(folder_ / "merged", {folder_ / "shard1", folder_ / "shard0"});
  EXPECT_EQ(StudyFiles(folder_ / "merged"), one);

  // Simulates kill -9: one trial is missing, one is cut short.
  fs::remove_all(folder_ / "one" / "trials" / plan.trials[0].id);
  WriteFileAtomically(folder_ / "one" / "trials" / plan.trials[2].id / "trial.json", "{\"id\": ");
  const StudySummary again = RunStudy(plan, folder_ / "one", {}, {});
  EXPECT_EQ(again.skipped, 2);
  EXPECT_EQ(again.done, 2);
  EXPECT_EQ(StudyFiles(folder_ / "one"), one);
}

// A changed study gives the same trials and tables as if it had never been different.
TEST_F(StudyTest, AChangedStudyKeepsItsTrialsAndGivesTheSameTablesThorough) {
  CopySmall("run");
  const StudyPlan changed = Plan(
      "subjects:\n  - {name: b, set: {subject.random_seed: 2}}\n"
      "  - {name: c, set: {subject.random_seed: 3}}\n"
      "grid: {interp: [{type: mean}, harmonic], rounds: [1], fit.features: [restore]}\nmetric: "
      "implicit_face.rms_mm\n");
  const StudySummary on = RunStudy(changed, folder_ / "run", {}, {});
  EXPECT_TRUE(on.changed);
  EXPECT_EQ(on.skipped, 1);  // b with mean
  EXPECT_EQ(on.done, 3);
  EXPECT_EQ(on.left_over, 3);
  const StudySummary fresh = RunStudy(changed, folder_ / "new", {}, {});
  EXPECT_FALSE(fresh.changed);
  auto run = StudyFiles(folder_ / "run");
  for (const auto& [name, bytes] : StudyFiles(folder_ / "new")) {
    EXPECT_EQ(run.at(name), bytes) << name;
  }
  EXPECT_EQ(RunStudy(changed, folder_ / "run", {}, {}).skipped, 4);
}

TEST_F(StudyTest, TrialsThatLackKeptFilesRunAgain) {
  const std::string one = "grid: {landmarks.max_distance_mm: [50]}\n";
  const StudyPlan summary = Plan(one), view = Plan(one + "keep: view\n");
  RunStudy(summary, folder_ / "run", {}, {});
  EXPECT_EQ(RunStudy(view, folder_ / "run", {}, {}).done, 1);
  EXPECT_TRUE(fs::exists(folder_ / "run" / "trials" / view.trials[0].id / "scene.json"));
  EXPECT_EQ(RunStudy(view, folder_ / "run", {}, {}).skipped, 1);
  EXPECT_EQ(RunStudy(summary, folder_ / "run", {}, {}).skipped, 1);
}

// Whatever is damaged in a trial, the next call gives the bytes of an undamaged study.
TEST_F(StudyTest, DamagedTrialsRunAgainThorough) {
  const StudyPlan plan = Plan(
      "subjects: [{name: a}]\ngrid: {interp: [nearest, {type: mean}]}\n"
      "metric: implicit_face.rms_mm\nkeep: view\n");
  const StudyRunOptions options{.jobs = 2, .cache = folder_ / "cache"};
  RunStudy(plan, folder_ / "run", options, {});
  const auto whole = StudyFiles(folder_ / "run");
  const fs::path one = folder_ / "run/trials" / plan.trials[0].id,
                 two = folder_ / "run/trials" / plan.trials[1].id;
  const auto change = [](const fs::path& file, const std::function<void(std::string&)>& edit) {
    std::string text = ReadFileBytes(file);
    edit(text);
    WriteFileAtomically(file, text);
  };
  const auto exchange_results = [&] {
    auto a = nlohmann::ordered_json::parse(ReadFileBytes(one / "trial.json")),
         b = nlohmann::ordered_json::parse(ReadFileBytes(two / "trial.json"));
    std::swap(a["result"], b["result"]);
    WriteFileAtomically(one / "trial.json", a.dump(1) + "\n");
    WriteFileAtomically(two / "trial.json", b.dump(1) + "\n");
  };
  const auto set_number = [&](const nlohmann::ordered_json& value) {
    auto json = nlohmann::ordered_json::parse(ReadFileBytes(one / "trial.json"));
    json["result"]["implicit_face"]["rms_mm"] = value;
    WriteFileAtomically(one / "trial.json", json.dump(1) + "\n");
  };
  const std::vector<std::function<void()>> damages = {
      [&] { fs::resize_file(one / "scene.json", 1000); },
      [&] { fs::remove(one / "scene.json"); },
      [&] { change(one / "scene.json", [](std::string& text) { text[text.size() / 2] ^= 1; }); },
      [&] { fs::resize_file(one / "trial.json", 500); },
      [&] {
        change(one / "trial.json", [](std::string& text) { text[text.find("rms_mm") + 12] ^= 1; });
      },
      exchange_results,
      [&] {
        fs::copy_file(one / "trial.json", two / "trial.json", fs::copy_options::overwrite_existing);
      },
      [&] { set_number(nullptr); },
      [&] { set_number("1.25"); },
  };
  for (std::size_t n = 0; n < damages.size(); ++n) {
    damages[n]();
    OutputFolder output(folder_ / "run", WhenNotEmpty::kReplaceFiles);
    const StudyResults results = WriteStudyTables(output);
    EXPECT_GE(results.Count("damaged"), 1) << n;
    EXPECT_EQ(results.Count("damaged") + results.Count("done"), 2) << n;
    EXPECT_THAT(ReadFileBytes(folder_ / "run/report.html"), HasSubstr("damaged and left out")) << n;
    if (n != 2) {  // a comparison reads no scene
      EXPECT_THAT(WordsOf<IoError>([&] {
                    ReadStudies({folder_ / "run", folder_ / "whole"});
                  }),
                  HasSubstr("damaged"))
          << n;
    }
    const StudySummary again = RunStudy(plan, folder_ / "run", options, {});
    EXPECT_EQ(static_cast<int>(again.damaged.size()), again.done) << n;
    EXPECT_EQ(StudyFiles(folder_ / "run"), whole) << n;
  }
}

// A sound trial of another folder replaces a damaged one; a damaged one is never taken.
TEST_F(StudyTest, AMergeReplacesDamagedTrialsAndTakesNone) {
  const StudyPlan plan = Plan(kSmall);
  CopySmall("whole");
  const auto whole = StudyFiles(folder_ / "whole");
  CopySmall("damaged");
  const fs::path file = folder_ / "damaged/trials" / plan.trials[0].id / "trial.json";
  std::string text = ReadFileBytes(file);
  text[text.find("rms_mm") + 12] ^= 1;
  WriteFileAtomically(file, text);
  const auto not_taken = GatherTrials(folder_ / "new", {folder_ / "damaged"});
  EXPECT_THAT(not_taken, ::testing::ElementsAre(HasSubstr("trial.json is not what was written")));
  EXPECT_EQ(ReadStudyResults(folder_ / "new").Count("missing"), 1);
  EXPECT_THAT(GatherTrials(folder_ / "damaged", {folder_ / "whole"}), ::testing::IsEmpty());
  EXPECT_EQ(StudyFiles(folder_ / "damaged"), whole);
}

TEST_F(StudyTest, TrialsOfAnotherVersionAreNamedAndCanRunAgain) {
  const StudyPlan plan = Plan(kSmall);
  CopySmall("run");
  const auto own = StudyFiles(folder_ / "run");
  EXPECT_THAT(VersionNotes(ReadStudyResults(folder_ / "run")), ::testing::IsEmpty());
  for (int n = 0; n < 3; ++n) {
    const fs::path file = folder_ / "run/trials" / plan.trials[n].id / "trial.json";
    auto json = nlohmann::ordered_json::parse(ReadFileBytes(file));
    json["version"] = "0.0.1";
    json["libraries"]["ceres"] = "1.0";
    WriteFileAtomically(file, json.dump(1) + "\n");
  }
  const std::string words = "3 of 4 trials were made by version 0.0.1";
  EXPECT_EQ(RunStudy(plan, folder_ / "run", {}, {}).skipped, 4);
  EXPECT_THAT(VersionNotes(ReadStudyResults(folder_ / "run")),
              ::testing::ElementsAre(HasSubstr(words)));
  EXPECT_THAT(StudyFiles(folder_ / "run").at("report.html"), HasSubstr(words));
  GatherTrials(folder_ / "merged", {folder_ / "run"});
  EXPECT_THAT(StudyFiles(folder_ / "merged").at("report.html"), HasSubstr(words));
  CopySmall("new");
  EXPECT_THAT(CompareStudies(ReadStudies({folder_ / "run", folder_ / "new"}), {}).notes,
              ::testing::Contains(HasSubstr(words)));
  EXPECT_EQ(RunStudy(plan, folder_ / "run", {.jobs = 2, .rerun = Rerun::kOtherVersions}, {}).done,
            3);
  EXPECT_EQ(StudyFiles(folder_ / "run"), own);
}

// The trial would have the id of the file as it was.
TEST_F(StudyTest, AFileThatChangesWhileAStudyRunsEndsIt) {
  const fs::path network = folder_ / "network.yaml";
  fs::copy_file(fmt::format("{}/configs/networks/standard32.yaml", SEMBLANCE_SOURCE_DIR), network);
  const StudyPlan plan = Plan("grid: {network: [network.yaml]}\n");
  WriteFileAtomically(network, ReadFileBytes(network) + "\n");
  EXPECT_THAT(WordsOf<IoError>([&] { RunStudy(plan, folder_ / "run", {}, {}); }),
              HasSubstr("network.yaml has changed since the study began"));
  EXPECT_EQ(ReadStudyResults(folder_ / "run").Count("missing"), 1);
  const StudyPlan changed = Plan("grid: {network: [network.yaml]}\n");
  EXPECT_NE(changed.trials[0].id, plan.trials[0].id);
}

TEST_F(StudyTest, OnlySelectedTrialsRunAndTheOthersCanFollow) {
  const StudyPlan plan = Plan(kSmall);
  const StudySummary part =
      RunStudy(plan, folder_ / "run", {.only = "subject = b and interp = mean"}, {});
  EXPECT_EQ(part.trials, 1);
  EXPECT_EQ(part.done, 1);
  EXPECT_EQ(ReadStudyResults(folder_ / "run").Count("missing"), 3);
  EXPECT_EQ(RunStudy(plan, folder_ / "run", {.rerun = Rerun::kAll, .only = "subject = b"}, {}).done,
            2);
  EXPECT_EQ(RunStudy(plan, folder_ / "run", {}, {}).done, 2);
  CopySmall("whole");
  EXPECT_EQ(StudyFiles(folder_ / "run"), StudyFiles(folder_ / "whole"));
  EXPECT_THAT(
      WordsOf<InputError>([&] { RunStudy(plan, folder_ / "none", {.only = "subject = x"}, {}); }),
      HasSubstr("holds for none of the 4 trials"));
  EXPECT_FALSE(fs::exists(folder_ / "none"));
}

TEST_F(StudyTest, ADepthStudySharesNoTrialWithAFaceStudy) {
  const std::string one = "grid: {landmarks.max_distance_mm: [50]}\n";
  const StudyPlan face = Plan(one),
                  depth = Plan(one + "job: depth\nmetric: depth_truth.tips.rms_mm\n");
  EXPECT_NE(face.trials[0].id, depth.trials[0].id);
}

// Every number of a real result is a metric that is known before the run.
TEST_F(StudyTest, TheMetricsOfARunAreKnownBeforeItThorough) {
  for (const auto& [job, text] :
       {std::pair{StudyJob::kFace, ""},
        std::pair{StudyJob::kDepth, "job: depth\nmetric: depth_truth.tips.rms_mm\n"}}) {
    const StudyPlan plan =
        Plan(fmt::format("grid: {{interp: [barycentric, kriging, auto]}}\n{}", text));
    const fs::path root = folder_ / EnumNames(job)[static_cast<int>(job)];
    RunStudy(plan, root, {}, {});
    EXPECT_NE(ComplaintAboutMetric("face.rms_mmx", job), "");
    for (const TrialRow& row : ReadStudyResults(root).trials) {
      EXPECT_GT(row.metrics.size(), 50u);
      for (const auto& [name, value] : row.metrics) {
        EXPECT_EQ(ComplaintAboutMetric(name, job), "");
      }
    }
  }
}

// A study of many trials keeps the numbers beside its metric, and those beside another on request.
TEST_F(StudyTest, ALargeStudyKeepsTheNumbersBesideItsMetric) {
  RunStudy(Plan("grid: {rounds: [1]}\n"), folder_ / "run", {}, {});
  const std::size_t all = ReadStudyResults(folder_ / "run").trials[0].metrics.size();
  auto plan = nlohmann::ordered_json::parse(ReadFileBytes(folder_ / "run/plan.json"));
  for (std::size_t n = plan["trials"].size(); n <= kMostTrialsInFull; ++n) {
    plan["trials"].push_back(plan["trials"][0]);
    plan["trials"].back()["id"] = fmt::format("{:012}", n);
  }
  WriteFileAtomically(folder_ / "run/plan.json", plan.dump());
  const StudyResults results = ReadStudyResults(folder_ / "run");
  EXPECT_THAT(results.notes, ::testing::Contains(HasSubstr("of the group face)")));
  EXPECT_LT(results.trials[0].metrics.size(), all);
  EXPECT_TRUE(results.trials[0].metrics.contains("face.median_mm"));
  EXPECT_FALSE(results.trials[0].metrics.contains("fit.dowel_rms_mm"));
  EXPECT_TRUE(ReadStudyResults(folder_ / "run", TrialCheck::kSizes, "fit.dowel_rms_mm")
                  .trials[0]
                  .metrics.contains("fit.dowel_rms_mm"));
}

TEST_F(StudyTest, DifferentAreasAreReported) {
  RunStudy(Plan("grid: {region.extent: [face, network]}\n"), folder_ / "unlike", {}, {});
  EXPECT_THAT(StudyFiles(folder_ / "unlike").at("report.html"),
              HasSubstr("were not measured on the same area (face.area_cm2"));
  RunStudy(Plan("grid: {landmarks.keep: [all, {type: spread, n: 12}]}\n"), folder_ / "alike", {},
           {});
  EXPECT_THAT(AreaNotes(ReadStudyResults(folder_ / "alike")), ::testing::IsEmpty());
}

TEST_F(StudyTest, AFailedTrialIsARowWithItsReason) {
  // With this radius no landmark is close enough to a skull of so few triangles.
  const StudyPlan plan = Plan("grid: {landmarks.max_distance_mm: [0, 50]}\n");
  const StudySummary summary = RunStudy(plan, folder_ / "run", {}, {});
  EXPECT_EQ(summary.failed, 1);
  EXPECT_EQ(summary.done, 1);
  const auto files = StudyFiles(folder_ / "run");
  EXPECT_THAT(files.at("trials.csv"), HasSubstr("failed,\"landmarks of phantom 1"));
  EXPECT_THAT(files.at("report.html"), HasSubstr("max_distance_mm"));
  EXPECT_EQ(RunStudy(plan, folder_ / "run", {}, {}).skipped, 2);
  EXPECT_EQ(RunStudy(plan, folder_ / "run", {.rerun = Rerun::kFailed}, {}).failed, 1);
}

TEST_F(StudyTest, MissingTrialsAreCounted) {
  const StudyPlan plan = Plan(kSmall);
  RunStudy(plan, folder_ / "run", {.shard = 1, .shards = 2}, {});
  OutputFolder output(folder_ / "run", WhenNotEmpty::kReplaceFiles);
  const StudyResults results = WriteStudyTables(output);
  EXPECT_EQ(results.Count("missing"), 2);
  EXPECT_EQ(results.Count("done"), 2);
  EXPECT_THAT(ReadFileBytes(folder_ / "run" / "report.html"), HasSubstr("too few for a test"));
}

TEST_F(StudyTest, AReportOfOneTreatmentHasNoDifferences) {
  RunStudy(Plan("grid: {landmarks.max_distance_mm: [50]}\n"), folder_ / "run", {}, {});
  const std::string report = StudyFiles(folder_ / "run").at("report.html");
  EXPECT_THAT(report, HasSubstr("Further tables"));
  EXPECT_THAT(report, Not(HasSubstr("Do the treatments differ?")));
}

TEST_F(StudyTest, AFolderOfAnotherPlanIsLeftAlone) {
  RunStudy(Plan(kSmall), folder_ / "run", {.shard = 1, .shards = 4}, {});
  EXPECT_THAT(WordsOf<IoError>(
                  [&] { RunStudy(Plan("grid: {rounds: [1, 2]}\n"), folder_ / "run", {}, {}); }),
              HasSubstr("holds another study"));
}

TEST_F(StudyTest, ResultsEqualThoseOfSingleRuns) {
  const StudyPlan plan = Plan(kSmall);
  CopySmall("run");
  const StudyResults results = ReadStudyResults(folder_ / "run");
  for (std::size_t n = 0; n < plan.trials.size(); ++n) {
    const RunResult alone = problems::Run(plan.trials[n].experiment, {});
    EXPECT_EQ(results.trials[n].metrics.at("face.rms_mm"), alone.truth->face.truth_to_face.rms_mm);
  }
}

TEST_F(StudyTest, TwelveFitsShareOneImplicitFaceThorough) {
  const StudyPlan one = Plan("list: [{fit.plan.schedule: [{level: 0, fraction: 0.05}]}]\n");
  const StudyPlan twelve = Plan(
      "zip: {fit.plan.schedule: [[{level: 0, fraction: 0.1}], [{level: 0, fraction: 0.2}],\n"
      "  [{level: 0, fraction: 0.3}], [{level: 0, fraction: 0.4}], [{level: 0, fraction: 0.5}],\n"
      "  [{level: 0, fraction: 0.6}], [{level: 0, fraction: 0.7}], [{level: 0, fraction: 0.8}],\n"
      "  [{level: 0, fraction: 0.9}], [{level: 0, fraction: 1}], [{level: 1, fraction: 0.5}],\n"
      "  [{level: 1, fraction: 1}]]}\n");
  const StudySummary alone = RunStudy(one, folder_ / "one", {}, {});
  const StudySummary all = RunStudy(twelve, folder_ / "twelve", {.jobs = 2}, {});
  EXPECT_EQ(all.done, 12);
  EXPECT_EQ(all.shared_made, alone.shared_made);
  const StudyPlan other = Plan("grid: {implicit.resolution: [20, 21]}\n");
  EXPECT_GT(RunStudy(other, folder_ / "other", {}, {}).shared_made, alone.shared_made);
}

TEST(StageCache, MakesEachValueOnceAndDropsTheLeastRecentlyUsed) {
  StageCache cache(2);
  int calls = 0;
  const auto get = [&](const std::string& key) {
    return *cache.Get<int>(key, [&] { return ++calls; });
  };
  EXPECT_EQ(get("a"), 1);
  EXPECT_EQ(get("a"), 1);
  EXPECT_EQ(get("b"), 2);
  EXPECT_EQ(get("a"), 1);
  EXPECT_EQ(get("c"), 3);
  EXPECT_EQ(get("a"), 1);
  EXPECT_EQ(get("b"), 4);
  EXPECT_EQ(cache.made(), 4);
  EXPECT_THROW(cache.Get<int>("bad", []() -> int { throw InputError("no"); }), InputError);
  EXPECT_EQ(*cache.Get<int>("bad", [] { return 9; }), 9);
}

}  // namespace
}  // namespace semblance::problems
