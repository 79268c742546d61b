// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/alternatives.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "problems/experiment/experiment_config.h"
#include "problems/report/run_folder.h"
#include "problems/report/run_report.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

const fs::path kConfigs = fs::path(SEMBLANCE_SOURCE_DIR) / "configs";

Experiment SmallPhantom(std::vector<std::string> overrides) {
  overrides.insert(
      overrides.begin(),
      {"subject.rings=20", "implicit.resolution=16", "template={type: formula, max_level: 1}",
       "seeds.level=0", "fit.plan.schedule=[{level: 0, fraction: 1}]", "uncertainty.sigma=false",
       "tissue={depths: table, table: " + (kConfigs / "tables/rhine_caucasoid.yaml").string() +
           "}"});
  return ReadConfig<Experiment>(kConfigs / "phantom.yaml", overrides);
}

const fs::path kTable = kConfigs / "tables/rhine_caucasoid.yaml";

// The alternatives of a file in the folder of configs/phantom.yaml.
std::vector<NamedExperiment> Named(const std::string& file) {
  ConfigErrors errors;
  const ConfigNode tree =
      LoadConfigTextTree(file, kConfigs / "mine.yaml", {}, MakeConfigTree(Experiment{}), errors);
  const auto experiment = ReadConfigTree<Experiment>(tree, errors);
  errors.ThrowIfAny();
  return MakeAlternatives(experiment, kConfigs, tree);
}

constexpr char kBase[] = "base: phantom.yaml\nsubject: {type: phantom, rings: 24}\n";

TEST(Alternatives, AreTheExperimentWithTheirSettings) {
  const Experiment experiment = SmallPhantom(
      {"alternatives=[{name: fat, set: [\"tissue.build=obese\", \"tissue.sex=female\"]}]"});
  const auto named = MakeAlternatives(experiment, kConfigs, {});
  ASSERT_EQ(named.size(), 1u);
  EXPECT_EQ(named[0].name, "fat");
  EXPECT_EQ(named[0].experiment.tissue.build, Build::kObese);
  EXPECT_EQ(named[0].experiment.tissue.sex, Sex::kFemale);
  EXPECT_TRUE(named[0].experiment.alternatives.empty());
  EXPECT_EQ(named[0].experiment.implicit.resolution, experiment.implicit.resolution);
}

TEST(Alternatives, PathsStartAtTheConfigurationsFolder) {
  const Experiment experiment = SmallPhantom(
      {"alternatives=[{name: other, set: [\"tissue.table=tables/t_table_2023.yaml\"]}]"});
  EXPECT_EQ(MakeAlternatives(experiment, kConfigs, {})[0].experiment.tissue.table,
            kConfigs / "tables/t_table_2023.yaml");
}

// `semblance run mine.yaml` passes an empty folder.
TEST(Alternatives, PathsOfAnEmptyFolderStartAtTheWorkingFolder) {
  const Experiment experiment =
      SmallPhantom({"alternatives=[{name: other, set: [\"tissue.table=mine.yaml\"]}]"});
  EXPECT_EQ(MakeAlternatives(experiment, "", {})[0].experiment.tissue.table,
            fs::current_path() / "mine.yaml");
}

TEST(Alternatives, AreCheckedBeforeAnythingRuns) {
  const auto of = [](const char* alternatives) {
    MakeAlternatives(SmallPhantom({std::string("alternatives=") + alternatives}), kConfigs, {});
  };
  EXPECT_THAT([&] { of("[{name: a, set: [\"tissue.build=thin\"]}]"); },
              ThrowsMessage<ConfigError>(HasSubstr("tissue.build")));
  EXPECT_THAT([&] { of("[{name: ../a}]"); }, ThrowsMessage<ConfigError>(HasSubstr("'../a'")));
  EXPECT_THAT([&] { of("[{name: a}, {name: a}]"); },
              ThrowsMessage<ConfigError>(HasSubstr("appears twice")));
  EXPECT_THAT([&] { of("[{name: a, set: [\"subject.random_seed=3\"]}]"); },
              ThrowsMessage<ConfigError>(HasSubstr("another `subject`")));
}

TEST(Alternatives, AllFaultsAreReportedTogetherAtTheirLines) {
  const std::string words = testing::WordsOf<ConfigError>([] {
    Named(std::string(kBase) +
          "alternatives:\n"
          "  - {name: a, set: [\"title=x\", \"tissue.sds=9\"]}\n"
          "  - {name: b, set: [\"face=placed\", \"uncertainty.samples=2\"]}\n"
          "  - {name: c, set: [\"tissue.sex\"]}\n"
          "  - {name: c}\n");
  });
  EXPECT_THAT(words, HasSubstr("mine.yaml:4:32: alternatives[0] 'a': tissue.sds: 9 is"));
  EXPECT_THAT(words, HasSubstr("mine.yaml:5:36: alternatives[1] 'b': uncertainty.samples: `face:"));
  EXPECT_THAT(words, HasSubstr("mine.yaml:6:21: alternatives[2] 'c': an override is written"));
  EXPECT_THAT(words, HasSubstr("mine.yaml:7:5: alternatives[3] 'c': the name appears twice"));
  EXPECT_THAT(words, Not(HasSubstr("--set")));
}

TEST(Alternatives, TheirInputsAreCheckedAndReportedByName) {
  const auto named = Named(
      fmt::format("{}tissue: {{depths: table, table: {}}}\n"
                  "alternatives:\n"
                  "  - {{name: lean, set: [\"tissue.build=emaciated\"]}}\n"
                  "  - {{name: gone, set: [\"tissue.table=none.yaml\"]}}\n"
                  "  - {{name: few, set: [\"landmarks.keep={{type: names, sites: [g, n]}}\"]}}\n",
                  kBase, kTable.string()));
  InputCheck inputs({});
  const CheckFindings own = inputs.Look(SmallPhantom({})),
                      found = CheckAlternatives(named, own, inputs);
  EXPECT_TRUE(own.sound());
  EXPECT_THAT(found.faults,
              ElementsAre(AllOf(HasSubstr("alternative 'gone': "), HasSubstr("none.yaml")),
                          HasSubstr("alternative 'few': ")));
  EXPECT_THAT(found.warnings,
              Contains(AllOf(HasSubstr("alternative 'lean': "), HasSubstr("no depth for 2"))));
}

TEST(Alternatives, LieBelowTheRunAndListLeftOutSitesThorough) {
  const Experiment experiment =
      SmallPhantom({"alternatives=[{name: lean, set: [\"tissue.build=emaciated\"]}]"});
  const testing::ScratchFolder scratch;
  OutputFolder folder(scratch / "out", WhenNotEmpty::kRefuse);
  StageCache cache(16);
  RunResult own = problems::Run(experiment, {}, &cache);
  own.implicit.notes = {"of the implicit face"};
  EXPECT_THAT(RunAlternatives(experiment, MakeAlternatives(experiment, kConfigs, {}), own, cache,
                              folder, {}),
              ElementsAre());
  const auto json = nlohmann::json::parse(ReadFileBytes(scratch / "out/alternatives.json"));
  ASSERT_EQ(json.size(), 2u);
  EXPECT_THAT(json[1]["left_out"], Contains("iM2_l"));  // missing from that table
  EXPECT_THAT(json[0]["notes"], Contains("of the implicit face"));
  EXPECT_LT(json[1]["difference"]["mean_mm"].get<double>(), -0.5);
  EXPECT_EQ(json[0]["left_out"].size(), 0u);
  for (const char* file :
       {"alternatives/lean/manifest.json", "alternatives/lean/result.json",
        "pictures/alternatives_front.png", "pictures/alternatives_difference.png"}) {
    EXPECT_TRUE(fs::exists(scratch / "out" / file)) << file;
  }
}

TEST(Alternatives, SitesWithoutADepthInTheRunsTableAreLeftOutThorough) {
  const Experiment experiment =
      SmallPhantom({"tissue.build=emaciated", "face=placed",
                    "alternatives=[{name: same}, {name: normal, set: [\"tissue.build=normal\"]}]"});
  const testing::ScratchFolder scratch;
  OutputFolder folder(scratch / "out", WhenNotEmpty::kRefuse);
  StageCache cache(16);
  const RunResult own = problems::Run(experiment, {}, &cache);
  RunAlternatives(experiment, MakeAlternatives(experiment, kConfigs, {}), own, cache, folder, {});
  const auto json = nlohmann::json::parse(ReadFileBytes(scratch / "out/alternatives.json"));
  EXPECT_THAT(json[0]["left_out"], Contains("iM2_l"));
  EXPECT_EQ(json[0]["left_out"], json[1]["left_out"]);
  EXPECT_EQ(json[1]["difference"]["rms_mm"].get<double>(), 0);
  EXPECT_THAT(json[2]["left_out"], Not(Contains("iM2_l")));
}

TEST(Alternatives, OfAnEarlierRunInTheFolderAreIgnored) {
  const testing::ScratchFolder scratch;
  const Experiment experiment = SmallPhantom({"face=placed"});
  OutputFolder folder(scratch / "out", WhenNotEmpty::kRefuse);
  WriteRun(experiment, problems::Run(experiment, {}), folder, {});
  folder.Write("alternatives.json", "[]");  // left by an earlier run
  WriteReport(folder);
  EXPECT_THAT(ReadFileBytes(scratch / "out/report.html"),
              Not(HasSubstr("Alternatives side by side")));
}

}  // namespace
}  // namespace semblance::problems
