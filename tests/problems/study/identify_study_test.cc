// SPDX-License-Identifier: GPL-3.0-or-later
// Identification as a study, on phantoms coarse enough to be quick.
#include "problems/study/identify_study.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "problems/study/report/study_report.h"
#include "problems/study/study_run.h"
#include "surfaces/base/atomic_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::ScratchFolder;

const std::string kStudy = fmt::format(
    "base: {}/configs/phantom.yaml\n"
    "job: identify\n"
    "set: {{subject.rings: 16, implicit.resolution: 16, seeds.level: 0, template.max_level: 1,\n"
    "      fit.plan.schedule: [{{level: 0, fraction: 1}}], first_fit: []}}\n"
    "subjects:\n  - {{name: a, set: {{subject.random_seed: 1}}}}\n"
    "  - {{name: b, set: {{subject.random_seed: 2}}}}\n"
    "  - {{name: c, set: {{subject.random_seed: 3}}}}\n"
    "metric: identify.surface.rank\n",
    SEMBLANCE_SOURCE_DIR);

class IdentifyStudy : public ::testing::Test {
 protected:
  StudyPlan Plan(const std::string& more = "") {
    WriteFileAtomically(folder_ / "study.yaml", kStudy + more);
    return ReadStudy(folder_ / "study.yaml");
  }
  // Puts the finished study into the folder. It runs once per process.
  void CopyFinished(const std::string& folder) {
    static const ScratchFolder done("_finished");
    if (!fs::exists(done / "run")) {
      RunStudy(Plan(), done / "run", {}, {});
    }
    fs::copy(done / "run", folder_ / folder, fs::copy_options::recursive);
  }
  ScratchFolder folder_;
};

TEST_F(IdentifyStudy, TheGalleryIsTheSubjectsAndTheOthers) {
  const StudyPlan plan = Plan("identify: {others: [{name: d, set: {subject.random_seed: 4}}]}\n");
  ASSERT_EQ(plan.gallery.size(), 4u);
  EXPECT_EQ(plan.gallery[3].name, "d");
  EXPECT_EQ(plan.trials.size(), 3u);
  EXPECT_NE(plan.trials[0].id, Plan().trials[0].id) << "the rank depends on the gallery";
}

TEST_F(IdentifyStudy, FaultsAreReported) {
  const auto fault = [&](const std::string& text) -> std::string {
    try {
      Plan(text);
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_THAT(fault("identify: {others: [{name: a}]}\n"),
              HasSubstr("'a' is one of the subjects already"));
  EXPECT_THAT(fault("identify: {others: [{set: {}}]}\n"), HasSubstr("has no name"));
  EXPECT_THAT(fault("identify: {ceiling_cell_mm: -1}\n"), HasSubstr("ceiling_cell_mm"));
  WriteFileAtomically(folder_ / "study.yaml",
                      "base: x.yaml\njob: depth\nidentify: {random_seed: 2}\n");
  EXPECT_THROW(ReadStudy(folder_ / "study.yaml"), ConfigError);
}

TEST_F(IdentifyStudy, TheTrueFaceRanksFirstAndTheGenericFaceByChance) {
  const StudyPlan plan = Plan();
  StageCache cache(20);
  std::set<double> floor_ranks;
  for (std::size_t own = 0; own < 3; ++own) {
    const IdentifyResult result =
        Identify(plan.trials[own].experiment, plan.gallery, own, plan.identify, {}, cache);
    EXPECT_EQ(result.gallery, 3);
    EXPECT_EQ(result.ceiling.surface.rank, 1) << own;
    EXPECT_EQ(result.ceiling.landmarks.rank, 1) << own;
    EXPECT_LT(result.ceiling.surface.own_mm, result.ceiling.surface.best_other_mm);
    EXPECT_GE(result.approximation.surface.rank, 1);
    EXPECT_LE(result.approximation.surface.rank, 3);
    floor_ranks.insert(result.floor.surface.rank);
  }
  EXPECT_EQ(floor_ranks, (std::set<double>{1, 2, 3}));
}

TEST_F(IdentifyStudy, TheReportHasTheCurvesAndWarnsOfASmallGallery) {
  CopyFinished("out");
  OutputFolder output(folder_ / "out", WhenNotEmpty::kReplaceFiles);
  const StudyResults results = WriteStudyTables(output);
  EXPECT_EQ(results.Count("done"), 3);
  EXPECT_EQ(results.trials[0].metrics.at("identify.gallery"), 3);
  const std::string html = ReadFileBytes(folder_ / "out" / "report.html");
  EXPECT_THAT(html, HasSubstr("The gallery holds 3 people. That is small"));
  EXPECT_THAT(html, HasSubstr("Cumulative match characteristic"));
  EXPECT_THAT(html, HasSubstr("floor: the generic face"));
  EXPECT_THAT(html, HasSubstr("ceiling: the true face, seen again"));
}

TEST_F(IdentifyStudy, SameBytesForAnyJobs) {
  const StudyPlan plan = Plan();
  CopyFinished("one");
  RunStudy(plan, folder_ / "two", {.jobs = 2}, {});
  for (const StudyTrial& trial : plan.trials) {
    const auto bytes = [&](const char* run) {
      return ReadFileBytes(folder_ / run / "trials" / trial.id / "trial.json");
    };
    EXPECT_EQ(bytes("one"), bytes("two"));
  }
}

}  // namespace
}  // namespace semblance::problems
