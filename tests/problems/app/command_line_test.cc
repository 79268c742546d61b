// SPDX-License-Identifier: GPL-3.0-or-later
// The whole program: messages, exit codes and files.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "problems/subject/phantom.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/program_call.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ScratchFolder;

const std::string kProgram = SEMBLANCE_PROGRAM;
const std::string kConfigs = SEMBLANCE_SOURCE_DIR "/configs";
const std::string kQuick =
    " --quiet --set subject.rings=16 --set implicit.resolution=16 --set template.max_level=1 "
    "--set 'fit.plan.schedule=[{level: 0, fraction: 1}]' --set face=placed";

class CommandLine : public ::testing::Test {
 protected:
  using Outcome = testing::Outcome;

  Outcome Call(const std::string& arguments) { return testing::CallProgram(folder_, arguments); }

  // Expects one line of error, exit code 2, and no result in `out`.
  void ExpectRefused(const std::string& arguments, const std::string& words) {
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_THAT(outcome.err, HasSubstr(words));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_FALSE(fs::exists(folder_ / "out" / "result.json"));
  }

  void Write(const std::string& name, const std::string& text) {
    WriteFileAtomically(folder_ / name, text);
  }

  // Writes a configuration whose skull is a ball with one landmark.
  void WriteBall(const Vec3& landmark) {
    Write("skull.ply", EncodeMesh(testing::SphereMesh({0, 0, 0}, 80, 40), ".ply"));
    Write("marks.yaml", fmt::format("subject: ball\nunits: mm\naxes: LPS\nlandmarks:\n"
                                    "  - {{site: g, point: [{}, {}, {}]}}\n",
                                    landmark.x(), landmark.y(), landmark.z()));
    Write("ball.yaml", fmt::format("subject: {{type: files, skull: skull.ply, landmarks: "
                                   "marks.yaml}}\nnetwork: {0}/networks/standard32.yaml\n"
                                   "tissue: {{table: {0}/tables/t_table_2023.yaml}}\n",
                                   kConfigs));
  }

  ScratchFolder folder_;
};

TEST_F(CommandLine, AMissingMetricIsReportedAndNothingIsRanked) {
  Write("study.yaml", fmt::format("base: {}/phantom.yaml\nset: {{subject.rings: 20}}\njob: depth\n"
                                  "metric: cross_validation.landmark.sites.nonsense\n",
                                  kConfigs));
  const Outcome outcome = Call("study study.yaml --out s --quiet");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.out, HasSubstr("no trial has the number "
                                     "'cross_validation.landmark.sites.nonsense'"));
  EXPECT_EQ(Call("status s").code, 1);
}

// Ceres reports the line search of a flat cost through glog, which would print it on the terminal.
TEST_F(CommandLine, LibrariesAreSilent) {
  const Outcome outcome = Call("depth " + kConfigs +
                               "/phantom.yaml --out d --quiet --set subject.rings=24 --set "
                               "'interp={type: kriging, length_mm: 3000}'");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.err, "");
}

TEST_F(CommandLine, ThePlanOfAStudyIsPrintedWithoutARun) {
  Write("study.yaml", fmt::format("base: {}/phantom.yaml\ngrid: {{rounds: [1, 2]}}\n", kConfigs));
  const Outcome plan = Call("study plan study.yaml --out out");
  EXPECT_EQ(plan.code, 0) << plan.err;
  EXPECT_EQ(std::count(plan.out.begin(), plan.out.end(), '\n'), 3) << plan.out;
  EXPECT_THAT(plan.out, HasSubstr(": 2 trials over rounds"));
  EXPECT_EQ(Call("study study.yaml --list --out out").out, plan.out);
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  ExpectRefused("study study.yaml study.yaml", "one study at a time");
}

TEST_F(CommandLine, HelpAndVersionExitWithZero) {
  EXPECT_EQ(Call("--help").code, 0);
  EXPECT_THAT(Call("--version").out, HasSubstr("semblance "));
  EXPECT_EQ(Call("").code, 2);
  EXPECT_EQ(Call("walk").code, 2);
}

TEST_F(CommandLine, RunWritesAReportAndPrintsItsPathThorough) {
  const Outcome outcome = Call("run " + kConfigs + "/phantom.yaml --out out" + kQuick);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("recovered face: mean "), HasSubstr("within 2.5 mm"),
                                 HasSubstr("out/report.html")));
  EXPECT_TRUE(fs::exists(folder_ / "out" / "manifest.json"));
}

TEST_F(CommandLine, DepthPrintsErrorsAgainstTheTruthAndLeftOutDowels) {
  const Outcome outcome = Call("depth " + kConfigs +
                               "/phantom.yaml --out depth --quiet --set subject.rings=24 "
                               "--set interp=network_spline");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("along the direction"), HasSubstr("cheeks"),
                                 HasSubstr("  k_fold"), HasSubstr("landmark left out")));
  EXPECT_TRUE(fs::exists(folder_ / "depth" / "depth.ply"));
  const Outcome given = Call("depth " + kConfigs +
                             "/phantom.yaml --out given --quiet --set subject.rings=24 "
                             "--set 'tissue={depths: table, table: " +
                             kConfigs + "/tables/t_table_2023.yaml, given: {measured: [g]}}'");
  EXPECT_EQ(given.code, 0) << given.err;
  EXPECT_THAT(given.out, HasSubstr("note: tissue depths are those expected given g"));
  ExpectRefused("depth " + kConfigs +
                    "/phantom.yaml --out map --quiet --set subject.rings=24 "
                    "--set interp=depth_map",
                "no file is named");
}

TEST_F(CommandLine, AnExistingFolderIsNotChangedWithoutForce) {
  const std::string run = "run " + kConfigs + "/phantom.yaml --out out" + kQuick;
  fs::create_directories(folder_ / "out");
  Write("out/mine.txt", "mine");
  const Outcome refused = Call(run);
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("exists and is not empty"));
  EXPECT_EQ(Call(run + " --force").code, 0);
  EXPECT_EQ(ReadFileBytes(folder_ / "out" / "mine.txt"), "mine");
  EXPECT_THAT(ReadFileBytes(folder_ / "out" / "manifest.json"), Not(HasSubstr("mine.txt")));
}

TEST_F(CommandLine, InputFilesInTheFolderAreNotReplaced) {
  WriteBall({0, -80, 0});
  fs::create_directories(folder_ / "out");
  Write("out/depth.ply", "mine");
  Write("out/resolved.yaml", fmt::format("base: {}/phantom.yaml\n", kConfigs));
  const auto refused = [&](const std::string& arguments, const std::string& file) {
    ExpectRefused(arguments + " --out out --force --quiet", "out/" + file + ": this file is read");
  };
  refused("run out/resolved.yaml", "resolved.yaml");
  refused("run ball.yaml --set 'interp={type: depth_map, file: out/depth.ply}'", "depth.ply");
  refused("depth ball.yaml --set 'interp={type: depth_map, file: out/depth.ply}'", "depth.ply");
  Write("out/table.yaml", "phantoms: {count: 3}\n");
  ExpectRefused("population out/table.yaml --out out", "out/table.yaml: this file is read");
  Write("e.yaml",
        "template: {type: formula, max_level: 1}\n"
        "fit: {plan: {type: coarse_to_fine, finest: 1}}\n");
  ASSERT_EQ(Call("template e.yaml --out made").code, 0);
  ExpectRefused(
      "template e.yaml --out made --force --set 'template={type: file, surface: "
      "made/head.hspline.json, sites: made/sites.csv, features: made/features.json}'",
      "made/head.hspline.json: this file is read");
}

TEST_F(CommandLine, AnUnwritableFolderIsRefusedBeforeAnyWork) {
  ExpectRefused("run " + kConfigs + "/phantom.yaml --out /proc/semblance" + kQuick,
                "/proc/semblance");
}

TEST_F(CommandLine, UnknownKeysAreNamedWithTheirPlace) {
  Write("e.yaml", "title: x\nnetwrk: a.yaml\n");
  ExpectRefused("run e.yaml --out out", "e.yaml:2:1: netwrk");
  EXPECT_THAT(Call("check e.yaml").err, HasSubstr("did you mean 'network'?"));
  EXPECT_EQ(Call("check e.yaml").code, 2);
}

TEST_F(CommandLine, ATruncatedMeshIsNamed) {
  WriteBall({0, -80, 0});
  const std::string ply = ReadFileBytes(folder_ / "skull.ply");
  Write("skull.ply", ply.substr(0, ply.size() / 2));
  ExpectRefused("run ball.yaml --quiet --out out", "skull.ply");
}

TEST_F(CommandLine, ALandmarkOffTheBoneIsNamedWithItsDistance) {
  WriteBall({0, -100, 0});
  ExpectRefused("run ball.yaml --quiet --out out", "site g (Glabella) is 20.0 mm from the skull");
}

TEST_F(CommandLine, AMissingTableCellThatIsNeededIsNamed) {
  WriteBall({0, -80, 0});
  Write("marks.yaml",
        "subject: ball\nunits: mm\naxes: LPS\nlandmarks:\n  - {site: fe_l, point: [0, -80, 0]}\n");
  ExpectRefused("run ball.yaml --quiet --out out", "fe_l");
}

TEST_F(CommandLine, ASkullWithTooFewLandmarksIsRefused) {
  WriteBall({0, -80, 0});
  ExpectRefused("run ball.yaml --quiet --out out",
                "no area of the dowel network has all its three dowels");
}

TEST_F(CommandLine, CheckFindsSidesThatAreSwapped) {
  const Phantom phantom = MakePhantom({.rings = 30});
  Write("skull.ply", EncodeMesh(phantom.skull, ".ply"));
  Write("e.yaml", fmt::format("subject: {{type: files, skull: skull.ply, landmarks: marks.yaml}}\n"
                              "network: {0}/networks/standard32.yaml\n"
                              "tissue: {{table: {0}/tables/rhine_caucasoid.yaml}}\n",
                              kConfigs));
  for (const bool swapped : {false, true}) {
    std::string marks = "subject: P\nlandmarks:\n";
    for (const PhantomSite& s : phantom.sites) {
      const double side = swapped ? -1 : 1;
      marks += fmt::format("  - {{site: {}, point: [{}, {}, {}]}}\n", s.site, side * s.base.x(),
                           s.base.y(), s.base.z());
    }
    Write("marks.yaml", marks);
    const Outcome outcome = Call("check e.yaml --set landmarks.max_distance_mm=10");
    EXPECT_EQ(outcome.code, swapped ? 2 : 0) << outcome.err;
    EXPECT_EQ(outcome.err.find("left and right are swapped") != std::string::npos, swapped);
  }
}

// `make configs` opens the files that they name.
TEST_F(CommandLine, ShippedConfigurationsHaveNoFault) {
  std::string files;
  for (const std::string& folder : {kConfigs, kConfigs + "/fit", kConfigs + "/studies"}) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      files += entry.path().extension() == ".yaml" ? fmt::format(" {}", entry.path().string()) : "";
    }
  }
  EXPECT_THAT(files, HasSubstr("franke.yaml"));
  const Outcome outcome = Call("check --without-inputs" + files);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
}

TEST_F(CommandLine, CheckDistinguishesFitsFromExperiments) {
  Write("fit.yaml", "patches_u: 4\nclosure: periodic_u\nfit: {plan: adaptive, terms: [points]}\n");
  EXPECT_EQ(Call("check fit.yaml").code, 0);
  Write("fit.yaml", "patches_u: 4\nclosure: periodic\nfit: {plan: adaptive, terms: [points]}\n");
  ExpectRefused("check fit.yaml", "fit.yaml:2:");
  Write("both.yaml", "patches_u: 4\nsubject: phantom\nrounds: 2\n");
  ExpectRefused("check both.yaml", "patches_u");
}

TEST_F(CommandLine, CheckReportsFaultsOfAStudy) {
  Write("study.yaml", fmt::format("base: {}/phantom.yaml\ngrid: {{rounds: [1, 2]}}\n", kConfigs));
  EXPECT_EQ(Call("check study.yaml").out, "study.yaml: no fault found\n");
  ExpectRefused("check study.yaml --set rounds=2", "write it into the study");
  Write("study.yaml", fmt::format("base: {}/phantom.yaml\ngird: {{}}\nkeep: all\n", kConfigs));
  const Outcome outcome = Call("check study.yaml");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err,
              AllOf(HasSubstr("study.yaml:2:1: gird: unknown key; did you mean 'grid'?"),
                    HasSubstr("study.yaml:3:7: keep: unknown word 'all'")));
}

// The names in `semblance --help`.
std::vector<std::string> CommandsIn(const std::string& help) {
  std::vector<std::string> names;
  std::istringstream lines(help.substr(help.find("Subcommands:")));
  std::string line;
  for (std::getline(lines, line); std::getline(lines, line);) {
    const std::size_t begin = line.find_first_not_of(' ');
    if (begin == 2) {
      names.push_back(line.substr(begin, line.find(' ', begin) - begin));
    }
  }
  return names;
}

TEST_F(CommandLine, TheReferenceHasEveryCommandAndNoOther) {
  const std::vector<std::string> commands = CommandsIn(Call("--help").out);
  EXPECT_THAT(commands, AllOf(::testing::Contains("run"), ::testing::Contains("feature")));
  const std::string page = ReadFileBytes(SEMBLANCE_SOURCE_DIR "/docs/reference/commands.md");
  for (const std::string& command : commands) {
    EXPECT_THAT(page, HasSubstr("\n    semblance " + command + " ")) << command;
  }
  const std::regex entry("\n    semblance ([a-z-]+)");
  for (std::sregex_iterator it(page.begin(), page.end(), entry), end; it != end; ++it) {
    EXPECT_THAT(commands, ::testing::Contains((*it)[1].str()));
  }
}

TEST_F(CommandLine, CheckWarnsOfATableWhoseDepthsDoNotGrowWithTheBuild) {
  Write("e.yaml", fmt::format("tissue: {{table: {0}/tables/rhine_black.yaml}}\n"
                              "network: {0}/networks/standard32.yaml\n",
                              kConfigs));
  const Outcome outcome = Call("check e.yaml");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("e.yaml: warning: tissue table 'rhine_black', sg "
                                     "(Supraglabella): depth does not grow from emaciated to "
                                     "obese: female 5.00 4.50 3.50 mm\n"));
  EXPECT_THAT(outcome.out, HasSubstr("e.yaml: no fault found"));
  EXPECT_THAT(Call("check e.yaml --set tissue.depths=measured").out, Not(HasSubstr("warning")));
}

TEST_F(CommandLine, CheckOpensEveryInputAndReportsEachFaultWithItsLine) {
  Write("e.yaml", fmt::format("base: {}/phantom.yaml\n"
                              "network: nowhere.yaml\n"
                              "tissue: {{depths: table, table: none.yaml}}\n"
                              "subject: {{type: files, skull: none.ply, landmarks: none.csv}}\n"
                              "rounds: 1000\n",
                              kConfigs));
  const Outcome outcome = Call("check e.yaml");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("e.yaml:2:10: network: no such file: "),
                                 HasSubstr("e.yaml:3:32: tissue.table: no such file: "),
                                 HasSubstr("e.yaml:4:31: subject.skull: no such file: "),
                                 HasSubstr("e.yaml:4:52: subject.landmarks: no such file: "),
                                 HasSubstr("e.yaml:5:9: rounds: 1000 is out of range")));
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 5) << outcome.err;
  EXPECT_EQ(Call("check --without-inputs e.yaml --set rounds=1").code, 0);
  Write("s.yaml", fmt::format("base: {}/phantom.yaml\n"
                              "grid: {{network: [{}/networks/standard32.yaml, broken.yaml]}}\n",
                              kConfigs, kConfigs));
  Write("broken.yaml", "areas: []\n");
  EXPECT_THAT(Call("check s.yaml").err, HasSubstr("broken.yaml"));
}

TEST_F(CommandLine, AMistypedWordGetsASuggestion) {
  EXPECT_THAT(Call("rnu e.yaml").err, HasSubstr("there is no command 'rnu'; did you mean 'run'?"));
  EXPECT_THAT(Call("run e.yaml --sett a=b").err,
              HasSubstr("run: there is no option '--sett'; did you mean '--set'?"));
  EXPECT_EQ(Call("rnu").code, 2);
}

// Calls every command that reads a file with files of the wrong kind. Each message must come from
// the program, not from a library.
TEST_F(CommandLine, MessagesDoNotQuoteLibrariesThorough) {
  Write("mesh.ply", EncodeMesh(testing::SphereMesh({0, 0, 0}, 82, 10), ".ply"));
  Write("empty.json", "");
  Write("map.json", "{}");
  fs::create_directories(folder_ / "dir");
  Write("dir/result.json", "{}");
  Write("dir/plan.json", "{}");
  for (const char* file : {"mesh.ply", "empty.json", "map.json", "dir"}) {
    for (const char* command :
         {"run {} --out o", "evaluate {} {}", "report {}", "study {} --out o", "merge o {}",
          "status {}", "edit {} {} --out o.json", "export {} --to o.glb", "feature list {}",
          "feature mirror {} --name a --library o"}) {
      const std::string line = std::regex_replace(command, std::regex(R"(\{\})"), file);
      const Outcome outcome = Call(line);
      EXPECT_THAT(outcome.code, ::testing::AnyOf(0, 2)) << line << "\n" << outcome.err;
      EXPECT_THAT(outcome.err, ::testing::ContainsRegex(outcome.code == 0 ? "" : "[a-z]")) << line;
      for (const char* word : {"exception", "std::", "basic_", "terminate", "YAML::", "CGAL"}) {
        EXPECT_THAT(outcome.err, Not(HasSubstr(word))) << line;
      }
    }
    fs::remove_all(folder_ / "o");
  }
}

TEST_F(CommandLine, TheTemplateIsWrittenAsAFileThatARunCanRead) {
  Write("e.yaml",
        "template: {type: formula, max_level: 1}\n"
        "fit: {plan: {type: coarse_to_fine, finest: 1}}\n");
  const Outcome written = Call("template e.yaml --out generic");
  EXPECT_EQ(written.code, 0) << written.err;
  const std::string from_file =
      "check --without-inputs e.yaml --set 'template={type: file, surface: "
      "generic/head.hspline.json, "
      "sites: generic/sites.csv, features: generic/features.json}'";
  EXPECT_EQ(Call(from_file).code, 0);
  EXPECT_THAT(Call(from_file + " --set fit.plan.finest=2").err,
              HasSubstr("take a template with more levels"));
  EXPECT_EQ(Call("template e.yaml --out generic").code, 2);
}

TEST_F(CommandLine, AnUnusableHeadForATemplateLeavesNoFiles) {
  Write("ball.ply", EncodeMesh(testing::SphereMesh({0, 0, 0}, 90, 20), ".ply"));
  Write("few.csv", "site,x,y,z\ng,0,-90,0\nn,0,-89,-10\n");
  const Outcome outcome = Call("template ball.ply few.csv --out made --quiet");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("semblance: ball.ply: its landmarks are 2 in the "
                                           "midline and 0 pairs"),
                                 HasSubstr("missing sites: sg, rhi")));
  EXPECT_FALSE(fs::exists(folder_ / "made"));
  EXPECT_EQ(Call("template ball.ply none.csv --out made").code, 2);
  EXPECT_THAT(Call("template ball.ply few.csv --set a=b").err, HasSubstr("--finest"));
}

TEST_F(CommandLine, OptionsNameEveryKeyAndTheSchemaIsJson) {
  const std::string options = Call("options").out;
  for (const char* key : {"subject", "emitter", "fraction", "tail_error", "random_seed"}) {
    EXPECT_THAT(options, HasSubstr(key));
  }
  EXPECT_TRUE(nlohmann::json::accept(Call("options --schema").out));
  EXPECT_THAT(Call("options study").out,
              AllOf(HasSubstr("grid: map by name: list: any value, default {}, at least 1 of them "
                              "each\n"),
                    HasSubstr("sample.n: whole number"), HasSubstr("subjects[].optional:")));
  const auto schema = nlohmann::json::parse(Call("options study --schema").out);
  EXPECT_EQ(schema["properties"]["keep"]["enum"], nlohmann::json({"summary", "view", "run"}));
  EXPECT_THAT(Call("options fit").out, HasSubstr("patches_u:"));
}

TEST_F(CommandLine, AnEmptyConfigurationIsNamedInItsRefusal) {
  Write("empty.yaml", "");
  ExpectRefused("run empty.yaml --out out --quiet", "empty.yaml: network: no file is named");
  ExpectRefused("depth empty.yaml --out out --quiet", "empty.yaml: network: no file is named");
}

TEST_F(CommandLine, AnEmptyValueOfAnOptionIsRefused) {
  Write("points.csv", "x,y,z\n0,0,0\n");
  ExpectRefused("fit points.csv --out ''", "--out is given an empty value");
  ExpectRefused("evaluate a.ply b.ply --landmarks ''", "--landmarks is given an empty value");
}

TEST_F(CommandLine, AFitOfFewPointsPrintsNoNan) {
  std::string points = "x,y,z\n";
  for (int k = 0; k < 35; ++k) {
    points += fmt::format("{},{},{}\n", k % 7, k / 7, 0.1 * std::sin(k));
  }
  Write("points.csv", points);
  const Outcome outcome = Call("fit points.csv --out out --quiet");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("35 points"), Not(HasSubstr("nan"))));
}

TEST_F(CommandLine, EvaluateMeasuresAnyTwoMeshes) {
  Write("a.ply", EncodeMesh(testing::SphereMesh({0, 0, 0}, 82, 60), ".ply"));
  Write("b.ply", EncodeMesh(testing::SphereMesh({0, 0, 0}, 80, 60), ".ply"));
  const Outcome outcome = Call("evaluate a.ply b.ply --quiet");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const auto metrics = nlohmann::json::parse(outcome.out);
  EXPECT_NEAR(metrics.at("mean_signed_mm").get<double>(), 2, 0.02);
  EXPECT_EQ(Call("evaluate a.ply none.ply").code, 2);
}

TEST_F(CommandLine, ReportRefusesAFolderThatIsNotARun) {
  EXPECT_EQ(Call("report nowhere").code, 2);
  fs::create_directories(folder_ / "empty");
  EXPECT_THAT(Call("report empty").err, HasSubstr("result.json"));
}

// A killed run leaves no folder of its name. The next run removes its temporary folder.
TEST_F(CommandLine, AKilledRunLeavesNoFileAndTheNextOneCleansUpThorough) {
  const std::string config = kConfigs + "/phantom.yaml", out = (folder_ / "out").string();
  const fs::path part = folder_ / ".out.semblance-part";
  const pid_t child = ::fork();
  if (child == 0) {
    ::execl(kProgram.c_str(), "semblance", "run", config.c_str(), "--out", out.c_str(), "--quiet",
            "--set", "subject.rings=24", "--set", "implicit.resolution=20", "--set",
            "template.max_level=2", nullptr);
    ::_exit(127);
  }
  while (!fs::exists(part / "face.ply") && ::waitpid(child, nullptr, WNOHANG) == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_NO_THROW(ReadMesh(part / "face.ply"));
  EXPECT_FALSE(fs::exists(out));
  EXPECT_EQ(Call("depth " + config + " --out out --quiet --set subject.rings=24").code, 0);
  EXPECT_TRUE(fs::exists(fs::path(out) / "result.json"));
  EXPECT_FALSE(fs::exists(fs::path(out) / "face.ply"));
  EXPECT_FALSE(fs::exists(part));
}

}  // namespace
}  // namespace semblance::problems
