// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/alternatives.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "problems/pipeline/experiment_config.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_folder.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const fs::path kConfigs = fs::path(SEMBLANCE_SOURCE_DIR) / "configs";

Experiment SmallPhantom(std::vector<std::string> overrides) {
  overrides.insert(
      overrides.begin(),
      {"subject.rings=24", "implicit.resolution=24", "template=formula", "uncertainty.sigma=false",
       "tissue={depths: table, table: " + (kConfigs / "tables/rhine_caucasoid.yaml").string() +
           "}"});
  return ReadConfig<Experiment>(kConfigs / "phantom.yaml", overrides);
}

TEST(Alternatives, AreTheExperimentWithWhatTheySet) {
  const Experiment experiment = SmallPhantom(
      {"alternatives=[{name: fat, set: [\"tissue.build=obese\", \"tissue.sex=female\"]}]"});
  const auto named = AlternativesOf(experiment, kConfigs);
  ASSERT_EQ(named.size(), 1u);
  EXPECT_EQ(named[0].name, "fat");
  EXPECT_EQ(named[0].experiment.tissue.build, Build::kObese);
  EXPECT_EQ(named[0].experiment.tissue.sex, Sex::kFemale);
  EXPECT_TRUE(named[0].experiment.alternatives.empty());
  EXPECT_EQ(named[0].experiment.implicit.resolution, experiment.implicit.resolution);
}

TEST(Alternatives, NameFilesFromTheConfigurationsFolder) {
  const Experiment experiment = SmallPhantom(
      {"alternatives=[{name: other, set: [\"tissue.table=tables/t_table_2023.yaml\"]}]"});
  EXPECT_EQ(AlternativesOf(experiment, kConfigs)[0].experiment.tissue.table,
            kConfigs / "tables/t_table_2023.yaml");
}

TEST(Alternatives, AreCheckedBeforeAnythingRuns) {
  const auto of = [](const char* alternatives) {
    AlternativesOf(SmallPhantom({std::string("alternatives=") + alternatives}), kConfigs);
  };
  EXPECT_THAT([&] { of("[{name: a, set: [\"tissue.build=thin\"]}]"); },
              ThrowsMessage<ConfigError>(HasSubstr("tissue.build")));
  EXPECT_THAT([&] { of("[{name: ../a}]"); }, ThrowsMessage<InputError>(HasSubstr("'../a'")));
  EXPECT_THAT([&] { of("[{name: a}, {name: a}]"); },
              ThrowsMessage<InputError>(HasSubstr("appears twice")));
}

TEST(Alternatives, StandBelowTheRunAndSayWhatIsLeftOut) {
  const Experiment experiment = SmallPhantom(
      {"alternatives=[{name: lean, set: [\"tissue.build=emaciated\"]}, {name: same}]"});
  const testing::ScratchFolder scratch;
  OutputFolder folder(scratch / "out", WhenNotEmpty::kRefuse);
  StageCache cache(16);
  const RunResult own = semblance::Run(experiment, {}, &cache);
  EXPECT_THAT(
      RunAlternatives(experiment, AlternativesOf(experiment, kConfigs), own, cache, folder, {}),
      ElementsAre());
  const auto json = nlohmann::json::parse(ReadFileBytes(scratch / "out/alternatives.json"));
  ASSERT_EQ(json.size(), 3u);
  EXPECT_THAT(json[1]["left_out"], Contains("iM2_l"));  // a hole of that table
  EXPECT_LT(json[1]["difference"]["mean_mm"].get<double>(), -0.5);
  EXPECT_EQ(json[2]["left_out"].size(), 0u);
  EXPECT_EQ(json[2]["difference"]["rms_mm"].get<double>(), 0);
  for (const char* file :
       {"alternatives/lean/manifest.json", "alternatives/same/result.json",
        "pictures/alternatives_front.png", "pictures/alternatives_difference.png"}) {
    EXPECT_TRUE(fs::exists(scratch / "out" / file)) << file;
  }
}

}  // namespace
}  // namespace semblance
