// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/evaluate.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "problems/experiment/experiment_config.h"
#include "problems/report/result_json.h"
#include "problems/report/run_folder.h"
#include "problems/run.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using testing::ScratchFolder;
using testing::WordsOf;

// A phantom in files, like the head of a user.
class EvaluateFace : public ::testing::Test {
 protected:
  void SetUp() override {
    const Phantom phantom = MakePhantom({.rings = 40});
    WriteBytes("skull.ply", EncodeMesh(phantom.skull, ".ply"));
    WriteBytes("skin.ply", EncodeMesh(phantom.face, ".ply"));
    std::string marks = "subject: P\nlandmarks:\n";
    for (const PhantomSite& s : phantom.sites) {
      marks += fmt::format(
          "  - {{site: {}, point: [{}, {}, {}], normal: [{}, {}, {}], depth_along_normal_mm: "
          "{}}}\n",
          s.site, s.base.x(), s.base.y(), s.base.z(), s.normal.x(), s.normal.y(), s.normal.z(),
          s.depth_mm);
    }
    WriteBytes("marks.yaml", marks);
    WriteBytes(
        "e.yaml",
        fmt::format(
            "subject: {{type: files, skull: skull.ply, skin: skin.ply, landmarks: "
            "marks.yaml}}\ntissue: {{depths: measured}}\nnetwork: "
            "{}/configs/networks/standard32.yaml\nfill: none\n"
            "implicit: {{resolution: 32}}\n"
            "template: {{type: formula, max_level: 1}}\nfit: {{plan: {{type: coarse_to_fine, "
            "finest: 1}}, relaxation: none}}\n"
            "region: {{exclude: [{{site: zy_r, radius_mm: 25}}]}}\n",
            SEMBLANCE_SOURCE_DIR));
  }
  void WriteBytes(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }
  EvaluateOptions OptionsOfRun() const {
    return {.face = folder_ / "face.hspline.json",
            .truth = {},
            .config = folder_ / "e.yaml",
            .overrides = {},
            .landmarks = {},
            .exclude = {}};
  }

  ScratchFolder folder_;
  std::vector<std::string> notes_;
};

TEST_F(EvaluateFace, GivesTheNumbersOfTheRun) {
  const auto experiment = ReadConfig<Experiment>(folder_ / "e.yaml");
  const RunResult run = problems::Run(experiment, {});
  WriteHSpline(folder_ / "face.hspline.json", run.fit.surface);
  const auto expected = ResultJson(experiment, run).at("face");
  const auto by_config = nlohmann::ordered_json::parse(Evaluate(OptionsOfRun(), {}, notes_).dump());
  EXPECT_EQ(by_config, expected);
  EXPECT_GT(expected.at("scored_skin").at("masked_cm2"), 5);

  EvaluateOptions by_files = OptionsOfRun();
  by_files.config.clear();
  by_files.truth = folder_ / "skin.ply";
  by_files.landmarks = folder_ / "marks.yaml";
  by_files.exclude = {ParseZone("zy_r=25")};
  EXPECT_EQ(nlohmann::ordered_json::parse(Evaluate(by_files, {}, notes_).dump()), expected);
}

// 3D Slicer states the axes of a model in its file.
TEST_F(EvaluateFace, TurnsAFaceInRasAndSaysSo) {
  EvaluateOptions options = OptionsOfRun();
  options.config.clear();
  options.truth = folder_ / "skin.ply";
  TriMesh face = ReadMesh(folder_ / "skin.ply");
  for (Vec3& p : face.points) {
    p = Vec3(-p.x(), -p.y(), p.z());
  }
  std::string bytes = EncodeMesh(face, ".ply");
  WriteBytes("face.ply", bytes.insert(bytes.find("element"), "comment SPACE=RAS\n"));
  options.face = folder_ / "face.ply";
  EXPECT_LT(Evaluate(options, {}, notes_).at("rms_mm").get<double>(), 1e-4);
  EXPECT_THAT(notes_, ::testing::ElementsAre(
                          "face.ply: the file states SPACE=RAS; turned to LPS (x and y negated)",
                          HasSubstr("the same surface")));
}

TEST_F(EvaluateFace, AFieldModelInRasIsThatInLps) {
  const std::filesystem::path field = SEMBLANCE_SOURCE_DIR "/../shared/data/field";
  if (!std::filesystem::exists(field)) {
    GTEST_SKIP() << "the inputs of the field are not here";
  }
  EvaluateOptions options;
  options.face = field / "ball-ras.ply";
  options.truth = field / "ball-lps.ply";
  EXPECT_LT(Evaluate(options, {}, notes_).at("rms_mm").get<double>(), 1e-4);
  EXPECT_THAT(notes_, ::testing::ElementsAre(HasSubstr("SPACE=RAS"), HasSubstr("same surface")));
}

TEST_F(EvaluateFace, RefusesOptionsThatCannotBeCombined) {
  EvaluateOptions options = OptionsOfRun();
  options.face = folder_ / "skin.ply";
  options.landmarks = folder_ / "marks.yaml";
  EXPECT_THAT(WordsOf<InputError>([&] { Evaluate(options, {}, notes_); }),
              HasSubstr("--landmarks"));
  options.config.clear();
  EXPECT_THAT(WordsOf<InputError>([&] { Evaluate(options, {}, notes_); }),
              HasSubstr("nothing to compare"));
  options.truth = folder_ / "skin.ply";
  options.landmarks.clear();
  options.exclude = {{"g", 10}};
  EXPECT_THAT(WordsOf<InputError>([&] { Evaluate(options, {}, notes_); }), HasSubstr("--exclude"));
}

TEST(ParseZone, ReadsASiteAndARadius) {
  EXPECT_EQ(ParseZone("zy_r=15").site, "zy_r");
  EXPECT_EQ(ParseZone("zy_r=15.5").radius_mm, 15.5);
  for (const char* text :
       {"", "zy_r", "zy_r=", "zy_r=x", "zy_r=-3", "zy_r=15mm", "elbow=3", "=3"}) {
    EXPECT_THAT(WordsOf<InputError>([&] { ParseZone(text); }), HasSubstr("--exclude")) << text;
  }
}

}  // namespace
}  // namespace semblance::problems
