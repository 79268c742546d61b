// SPDX-License-Identifier: GPL-3.0-or-later
// The findings of `semblance check` in the inputs that an experiment names.
#include "problems/experiment/input_files.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iterator>
#include <regex>
#include <string>

#include "problems/experiment/experiment_config.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/scratch_folder.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::ScratchFolder;
using ::testing::SizeIs;

const std::string kConfigs = SEMBLANCE_SOURCE_DIR "/configs";

class InputCheckTest : public ::testing::Test {
 protected:
  InputCheckTest() {
    WriteFileAtomically(folder_ / "ball.ply",
                        EncodeMesh(testing::SphereMesh({0, 0, 0}, 90, 20), ".ply"));
    Write("broken.ply", "ply\nnothing more");
    Write("broken.yaml", "areas: [");
    Write("marks.yaml", "subject: x\nlandmarks: [{site: g, point: [0, -90, 0]}]\n");
  }
  void Write(const std::string& name, const std::string& text) {
    WriteFileAtomically(folder_ / name, text);
  }
  Experiment Of(const std::string& text) {
    return ReadConfigText<Experiment>(text, folder_ / "e.yaml");
  }
  CheckFindings Look(const std::string& text) { return InputCheck({}).Look(Of(text)); }

  ScratchFolder folder_;
};

TEST_F(InputCheckTest, ASoundExperimentHasNoFault) {
  const CheckFindings found = Look(fmt::format("base: {}/phantom.yaml\n", kConfigs));
  EXPECT_THAT(found.faults, IsEmpty());
}

TEST_F(InputCheckTest, AllFaultsOfAllInputsAreReportedALineEach) {
  const CheckFindings found = Look(
      "subject: {type: files, skull: broken.ply, skin: none.ply, landmarks: broken.yaml}\n"
      "network: broken.yaml\ntissue: {table: none.yaml}\nedits: none_edits.yaml\n"
      "interp: {type: depth_map, file: none_map.ply}\n");
  for (const char* file :
       {"broken.ply", "none.ply", "broken.yaml", "none.yaml", "none_edits.yaml", "none_map.ply"}) {
    EXPECT_THAT(found.faults, Contains(HasSubstr(file))) << file;
  }
  for (const std::string& fault : found.faults) {
    EXPECT_EQ(fault.find('\n'), fault.npos);
  }
}

TEST_F(InputCheckTest, LandmarksAreLaidOnTheBone) {
  const std::string skull = "subject: {type: files, skull: ball.ply, landmarks: marks.yaml}\n";
  Write("marks.yaml", "subject: x\nlandmarks: [{site: g, point: [0, -99, 0]}]\n");
  const CheckFindings found = Look(fmt::format(
      "{}network: {}/networks/standard32.yaml\ntissue: {{depths: measured}}\n", skull, kConfigs));
  EXPECT_THAT(found.faults, Contains(HasSubstr("no dowel has a tissue depth")));
  const CheckFindings with_table = Look(fmt::format(
      "{0}network: {1}/networks/standard32.yaml\ntissue: {{table: {1}/tables/rhine_caucasoid.yaml}}"
      "\n",
      skull, kConfigs));
  EXPECT_THAT(with_table.faults, Contains(HasSubstr("mm from the skull")));
}

TEST_F(InputCheckTest, WarnsOfSitesThatATableLacks) {
  const CheckFindings found = Look(fmt::format(
      "base: {}/phantom.yaml\ntissue: {{depths: table, table: {}/tables/rhine_caucasoid.yaml, "
      "build: emaciated}}\n",
      kConfigs, kConfigs));
  EXPECT_THAT(found.faults, IsEmpty());
  EXPECT_THAT(found.warnings, Contains(HasSubstr("no depth for 2 of the 32 landmarks")));
}

TEST_F(InputCheckTest, RulesAndSitesOfAPhantomAreChecked) {
  const std::string base =
      fmt::format("base: {}/phantom.yaml\nsubject: {{type: phantom, rings: 20}}\n", kConfigs);
  EXPECT_THAT(Look(base + "rules: {points: {uc_l: [18000, 0, -60]}}\n").faults,
              Contains(HasSubstr("rules.points.uc_l: it is")));
  EXPECT_THAT(Look(base + "landmarks: {keep: {type: names, sites: [g, n]}}\n").faults,
              Contains(HasSubstr("landmarks.keep leaves 2 of 32")));
  const std::string uv = "sites: {g: {uv: [0.5, 0.6]}}\ntemplate: ict\n";
  EXPECT_THAT(Look(base + uv + "face: prior\n").faults,
              Contains(HasSubstr("sites.g.uv: `face: prior` has its own place")));
  EXPECT_THAT(Look(base + uv).faults, IsEmpty());
  EXPECT_THAT(Look(base + "face: placed\nrounds: 2\n").warnings,
              Contains(HasSubstr("rounds: `face: placed` does not use it")));
}

TEST_F(InputCheckTest, WarnsOfARuleThatDoesNotApply) {
  const std::string base =
      fmt::format("base: {}/phantom.yaml\nsubject: {{type: phantom, rings: 20}}\n", kConfigs);
  const std::string asked = "rules: {mouth_width: {use: true}}\n";
  const auto lacks =
      Contains(HasSubstr("rules.mouth_width is on, and it lacks uc_l, uc_r under rules.points"));
  EXPECT_THAT(Look(base + asked + "template: ict\nface: prior\n").warnings, lacks);
  EXPECT_THAT(Look(base + asked + "face: fit\n").warnings,
              Contains(HasSubstr("rules.mouth_width is on, and the face uses no prior")));
  EXPECT_THAT(Look(base + "template: ict\nface: prior\n").warnings, IsEmpty());
}

TEST_F(InputCheckTest, AKnownDepthReplacesAMissingOne) {
  const CheckFindings found = Look(fmt::format(
      "base: {0}/phantom.yaml\ntissue: {{depths: table, table: {0}/tables/t_table_2023.yaml, "
      "given: {{depths_mm: {{fe: 4}}}}}}\n",
      kConfigs));
  EXPECT_THAT(found.faults, IsEmpty());
  EXPECT_THAT(found.warnings, Contains(HasSubstr("no depth for ")));
  EXPECT_THAT(found.warnings, Not(Contains(HasSubstr("fe_l"))));
}

TEST_F(InputCheckTest, AFaultOfAnInputIsReportedOnceForManyExperiments) {
  InputCheck check({});
  const Experiment experiment = Of("network: broken.yaml\n");
  CheckFindings all = check.Look(experiment);
  const std::size_t faults = all.faults.size();
  all.Add(check.Look(experiment));
  EXPECT_GE(faults, 1u);
  EXPECT_THAT(all.faults, SizeIs(faults));
}

// A missing file is a fault, whichever option names it.
TEST_F(InputCheckTest, NoOptionMayNameAMissingFile) {
  const std::regex word("none");
  for (const std::string text :
       {"network: none.x", "tissue: {table: none.x}", "edits: none.x",
        "tissue: {table: none.x, fill_from: none.x}",
        "subject: {type: files, skull: none.x, skin: none.x, landmarks: none.x, mandible: {mesh: "
        "none.x}}",
        "subject: {type: ct, volume: none.x, landmarks: none.x}",
        "prior: {type: modes, mean: none.x, modes: none.x, sites: none.x, features: none.x}",
        "prior: {type: hspline, modes: none.x}",
        "interp: {type: depth_map, file: none.x, mesh: none.x}"}) {
    const Experiment experiment = Of(text + "\n");
    const auto named = NamedInputs(experiment);
    const auto times = std::sregex_iterator(text.begin(), text.end(), word);
    EXPECT_EQ(named.size(), static_cast<std::size_t>(std::distance(times, {}))) << text;
    EXPECT_FALSE(InputCheck({}).Look(experiment).sound()) << text;
  }
}

// The files on which other options depend are read with the options.
TEST_F(InputCheckTest, TemplateAndBustAreReadWithTheOptions) {
  for (const char* text : {"template: {type: file, surface: none.x, sites: none.x}\n",
                           "bust: {type: hspline, file: none.x}\n",
                           "bust: {type: mesh, mesh: none.x, landmarks: none.x}\n"}) {
    EXPECT_THROW(Of(text), ConfigError) << text;
  }
}

TEST_F(InputCheckTest, AnUnusedTableIsNoInput) {
  EXPECT_THAT(NamedInputs(Of("tissue: {depths: measured, table: none.x}\n")), IsEmpty());
}

}  // namespace
}  // namespace semblance::problems
