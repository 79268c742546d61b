// SPDX-License-Identifier: GPL-3.0-or-later
// Schemes and metrics of the caller in a study of depth.
#include "problems/study/study_plugins.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "problems/study/report/study_report.h"
#include "problems/study/study_metrics.h"
#include "problems/study/study_run.h"
#include "problems/study/study_tables.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::ScratchFolder;
using testing::WordsOf;

const char* const kTrueDepthMetric = "metric: depth_truth.along_direction.rms_mm\n";

// The mean of the dowels' depths times `factor`.
NamedScheme ScaledMean(const std::string& hash) {
  const auto interpolate = [](const DepthInput& input,
                              const std::map<std::string, std::string>& options) {
    double sum = 0;
    for (const Dowel& dowel : input.dowels) {
      sum += dowel.depth_mm;
    }
    const double depth_mm =
        std::stod(options.at("factor")) * sum / static_cast<double>(input.dowels.size());
    if (depth_mm < 0) {
      throw ExternalFailure("scaled: ValueError: below 0", "Traceback of scaled");
    }
    return ExternalDepths{std::vector<double>(input.skull.points.size(), depth_mm), {}};
  };
  return {.name = "scaled",
          .source_hash = hash,
          .options = {{"factor", ExternalOption::Kind::kNumber, "1.0"}},
          .function = std::make_shared<const ExternalFunction>(
              ExternalFunction{.interpolate = interpolate})};
}

OwnMetric Doubled() {
  return {"doubled", "1", [](const MeasuredTrial& trial) {
            return 2 * trial.numbers["depth_truth"]["along_direction"]["rms_mm"].get<double>();
          }};
}

class StudyPluginsTest : public ::testing::Test {
 protected:
  std::filesystem::path Write(const std::string& text) {
    const std::filesystem::path file = folder_ / "study.yaml";
    WriteFileAtomically(file, fmt::format("base: {}/configs/phantom.yaml\njob: depth\n"
                                          "set: {{subject.rings: 24}}\n{}",
                                          SEMBLANCE_SOURCE_DIR, text));
    return file;
  }
  StudyPlan Plan(const std::string& text, const StudyPlugins& plugins) {
    return ReadStudy(Write(text), WithoutSubjects::kFault, plugins);
  }
  std::string Faults(const std::string& text, const StudyPlugins& plugins = {}) {
    return WordsOf<Error>([&] { Plan(text, plugins); });
  }

  ScratchFolder folder_;
};

TEST_F(StudyPluginsTest, OwnSchemeOfTheSameFormulaGivesTheNumbersOfTheBuiltInOne) {
  const StudyPlan plan = Plan("grid: {interp: [mean, scaled]}\nmetric: doubled\n",
                              {.schemes = {ScaledMean("1")}, .metrics = {Doubled()}});
  RunStudy(plan, folder_ / "out", {.jobs = 2}, {});
  const StudyResults results = ReadStudyResults(folder_ / "out");
  ASSERT_EQ(results.Count("done"), 2) << results.trials.front().reason;
  const auto& built_in = results.trials[0].metrics;
  const auto& own = results.trials[1].metrics;
  for (const auto& [name, value] : built_in) {
    ASSERT_TRUE(own.contains(name)) << name;
    EXPECT_NEAR(own.at(name), value, 1e-9) << name;
  }
  EXPECT_DOUBLE_EQ(own.at("doubled"), 2 * own.at("depth_truth.along_direction.rms_mm"));
}

TEST_F(StudyPluginsTest, FailureEndsItsOwnTrialAndLeavesItsTraceback) {
  const std::string grid = "grid: {interp: [{type: scaled, factor: -1}, scaled]}\n";
  const StudyPlan plan = Plan(grid + kTrueDepthMetric, {.schemes = {ScaledMean("1")}});
  const StudySummary summary = RunStudy(plan, folder_ / "out", {}, {});
  EXPECT_EQ(summary.failed, 1);
  EXPECT_EQ(summary.done, 1);
  const StudyResults results = ReadStudyResults(folder_ / "out");
  EXPECT_EQ(results.trials[0].status, "failed");
  EXPECT_EQ(results.trials[0].reason, "scaled: ValueError: below 0");
  EXPECT_EQ(ReadFileBytes(folder_ / "out/trials" / plan.trials[0].id / "traceback.txt"),
            "Traceback of scaled");
}

TEST_F(StudyPluginsTest, IdFollowsTheSourceAndTheOptionsButNotTheirSpelling) {
  const auto id = [&](const std::string& scheme, const StudyPlugins& plugins) {
    return Plan("grid: {interp: [" + scheme + "]}\n" + kTrueDepthMetric, plugins).trials.front().id;
  };
  const StudyPlugins one{.schemes = {ScaledMean("1")}}, two{.schemes = {ScaledMean("2")}};
  EXPECT_NE(id("scaled", one), id("scaled", two));
  EXPECT_NE(id("scaled", one), id("{type: scaled, factor: 2}", one));
  EXPECT_EQ(id("scaled", one), id("{type: scaled, factor: 1}", one));
  EXPECT_EQ(id("mean", one), id("mean", {})) << "a scheme that is not used changes no id";
  EXPECT_NE(id("mean", {.metrics = {Doubled()}}), id("mean", {}));
}

TEST_F(StudyPluginsTest, EveryMistakeHasItsPlaceAndARemedy) {
  const StudyPlugins loaded{.schemes = {ScaledMean("1")}};
  EXPECT_THAT(Faults("plugins: [mine.py]\ngrid: {interp: [scaled]}\n"),
              AllOf(HasSubstr("study.yaml:4:"), HasSubstr("'mine.py' is written in Python"),
                    HasSubstr("python3 -m semblance study")));
  EXPECT_THAT(Faults("grid: {interp: [scaled]}\n"),
              AllOf(HasSubstr("study.yaml:4:"), HasSubstr("'scaled'")));
  EXPECT_THAT(Faults("grid: {interp: [{type: scaled, facter: 2}]}\n", loaded),
              AllOf(HasSubstr("study.yaml:4:"), HasSubstr("did you mean 'factor'")));
  EXPECT_THAT(Faults("grid: {interp: [{type: scaled, factor: many}]}\n", loaded),
              HasSubstr("interp.factor"));
  NamedScheme taken = ScaledMean("1");
  taken.name = "kriging";
  EXPECT_THAT(Faults("grid: {rounds: [1]}\n", {.schemes = {taken}}), HasSubstr("'kriging'"));
  OwnMetric metric = Doubled();
  metric.name = "depth";
  EXPECT_THAT(Faults("grid: {rounds: [1]}\n", {.metrics = {metric}}), HasSubstr("'depth'"));
  EXPECT_THAT(Faults("set: {}\nmetric: doubles\n", {.metrics = {Doubled()}}), HasSubstr("set"));
}

TEST_F(StudyPluginsTest, ResolvedFileOfAnotherSourceIsRefused) {
  const StudyPlugins one{.schemes = {ScaledMean("1")}};
  const StudyPlan plan =
      Plan("grid: {interp: [{type: scaled, factor: 2}]}\n" + std::string(kTrueDepthMetric), one);
  const auto file = folder_ / "resolved.yaml";
  WriteFileAtomically(file, WriteConfig(plan.trials.front().experiment));
  const Experiment again = ReadExperiment(file, {}, one.schemes);
  EXPECT_EQ(std::get<ExternalScheme>(again.interp).options.at("factor"), "2");
  const std::vector<NamedScheme> other = {ScaledMean("2")};
  EXPECT_THAT(WordsOf<ConfigError>([&] { ReadExperiment(file, {}, other); }),
              HasSubstr("the source of the scheme 'scaled' has changed"));
  EXPECT_THAT(WordsOf<ConfigError>([&] { ReadConfig<Experiment>(file); }),
              HasSubstr("'scaled' is written in Python and is not loaded"));
}

TEST_F(StudyPluginsTest, ExpressionIsTheMetricOfRankingAndTable) {
  const std::string expression =
      "depth_truth.along_direction.rms_mm + 0.5 * abs(depth_truth.along_direction.mean_signed_mm)";
  const StudyPlan plan =
      Plan("grid: {interp: [mean, nearest]}\nmetric: \"" + expression + "\"\n", {});
  RunStudy(plan, folder_ / "out", {}, {});
  const StudyResults results = ReadStudyResults(folder_ / "out");
  EXPECT_TRUE(results.HasMetric());
  for (const TrialRow& row : results.trials) {
    const auto& m = row.metrics;
    EXPECT_DOUBLE_EQ(m.at(expression),
                     m.at("depth_truth.along_direction.rms_mm") +
                         0.5 * std::abs(m.at("depth_truth.along_direction.mean_signed_mm")));
  }
  EXPECT_THAT(Faults("metric: \"depth_truth.along_direction.rms_m + 1\"\n"),
              HasSubstr("did you mean 'depth_truth.along_direction.rms_mm'"));
  EXPECT_THAT(Faults("metric: \"depth_truth.along_direction.rms_mm + \"\n"),
              AllOf(HasSubstr("study.yaml:4:"), HasSubstr("at its end")));
}

TEST_F(StudyPluginsTest, MapHasAFilePerSubject) {
  const std::string subjects = "subjects: [{name: a}, {name: b, set: {subject.random_seed: 2}}]\n";
  const std::string grid = "grid: {interp: [mean, {type: depth_map, file: \"{subject}.ply\"}]}\n";
  WriteFileAtomically(folder_ / "a.ply", "not read by the plan");
  EXPECT_THAT(Faults(subjects + grid + kTrueDepthMetric),
              AllOf(HasSubstr("subject b"), HasSubstr("b.ply")));
  WriteFileAtomically(folder_ / "b.ply", "not read by the plan");
  const StudyPlan plan = Plan(subjects + grid + kTrueDepthMetric, {});
  EXPECT_EQ(std::get<DepthMap>(plan.trials.at(3).experiment.interp).file.filename(), "b.ply");
  EXPECT_EQ(plan.trials.at(1).values, plan.trials.at(3).values) << "one treatment";
  EXPECT_THAT(Faults("grid: {interp: [mean, depth_map]}\n" + std::string(kTrueDepthMetric)),
              AllOf(HasSubstr("study.yaml:4:"), HasSubstr("no file is named")));
}

TEST(Metrics, AreListedWithTheirUnits) {
  const std::string text = MetricsText(StudyJob::kFace);
  EXPECT_THAT(text, ::testing::ContainsRegex("\nface.rms_mm +mm\n"));
  EXPECT_THAT(text, ::testing::ContainsRegex("\nface.within_2_5mm +share\n"));
  EXPECT_THAT(text, ::testing::ContainsRegex("\nface.area_cm2 +cm²\n"));
}

}  // namespace
}  // namespace semblance::problems
