// SPDX-License-Identifier: GPL-3.0-or-later
// `semblance fit` from the command line, from files to files.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "problems/io/given_files.h"
#include "problems/points/fit_report.h"
#include "problems/points/point_files.h"
#include "problems/points/point_fit.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/random.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "surfaces/mesh_files/read_ply.h"
#include "tests/testing/program_call.h"
#include "tests/testing/scattered_data.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using testing::ErrorAgainst;
using testing::FrankePoint;
using ::testing::HasSubstr;
using testing::HeadPoint;
using testing::PlainCsv;
using testing::Scattered;
using testing::UvCsv;

const std::string kFitConfigs = SEMBLANCE_SOURCE_DIR "/configs/fit";

class FitCommand : public ::testing::Test {
 protected:
  testing::Outcome Call(const std::string& arguments) {
    return testing::CallProgram(folder_, arguments);
  }
  void Write(const std::string& name, const std::string& text) {
    fs::create_directories((folder_ / name).parent_path());
    WriteFileAtomically(folder_ / name, text);
  }
  testing::ScratchFolder folder_;
};

TEST_F(FitCommand, FrankesFunctionAndTheHeadComeOut) {
  Write("franke.csv", UvCsv(Scattered(FrankePoint, 10000, 1e-3, 1)));
  Write("head.csv", UvCsv(Scattered(HeadPoint, 30000, 1e-4, 1)));
  for (const char* name : {"franke", "head"}) {
    const auto outcome =
        Call(fmt::format("fit {0}.csv {1}/{0}.yaml --out {0} --quiet", name, kFitConfigs));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("(u,v): given"));
    for (const char* file : {"surface.ply", "residuals.csv", "resolved.yaml", "timing.json"}) {
      EXPECT_TRUE(fs::exists(folder_ / name / file)) << file;
    }
  }
  EXPECT_LT(ErrorAgainst(FrankePoint, ReadHSpline(folder_ / "franke/surface.hspline.json"), 60).rms,
            1e-3);
  EXPECT_LT(ErrorAgainst(HeadPoint, ReadHSpline(folder_ / "head/surface.hspline.json"), 60).rms,
            2e-4);
  const auto json = nlohmann::json::parse(ReadFileBytes(folder_ / "franke/result.json"));
  EXPECT_EQ(json["points"], 10000);
  EXPECT_GT(json["levels"].back()["auto_weight"], 0.0);
  EXPECT_GT(ReadMesh(folder_ / "head/surface.ply").triangles.size(), 1000u);
}

// Without (u,v): the residuals are the noise, 1e-3 per coordinate.
TEST_F(FitCommand, AHeightFieldKeepsItsNoise) {
  Write("franke.csv", PlainCsv(Scattered(FrankePoint, 5000, 1e-3, 1)));
  const auto outcome =
      Call(fmt::format("fit franke.csv {}/height_field.yaml --out out --quiet", kFitConfigs));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(ReadFileBytes(folder_ / "out/result.json"));
  const double noise = std::sqrt(3) * 1e-3;
  EXPECT_GT(json["rms_mm"], 0.8 * noise);
  EXPECT_LT(json["rms_mm"], 1.1 * noise);
}

TEST_F(FitCommand, TheTableOfTheReadmeIsFittedWithoutAConfiguration) {
  const auto outcome =
      Call(fmt::format("fit {}/points.csv --set residuals=ply --out out --quiet", kFitConfigs));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("outliers left out"));
  EXPECT_TRUE(fs::exists(folder_ / "out/residuals.ply"));
  EXPECT_FALSE(fs::exists(folder_ / "out/residuals.csv"));
  const auto json = nlohmann::json::parse(ReadFileBytes(folder_ / "out/result.json"));
  EXPECT_NEAR(json["automatic"]["noise_mm"], 2e-3, 2e-4);
  EXPECT_NEAR(json["automatic"]["outlier_count"], 20, 2);
}

// (u,v) that are off by a hundredth blur the head, unless they are moved first.
TEST_F(FitCommand, UvMoveBeforeTheFitIfRequested) {
  FitTarget target = Scattered(HeadPoint, 8000, 1e-4, 1);
  Random random(2);
  for (FitPoint& p : target.points) {
    const double u = p.uv.x() + 0.01 * random.Normal(), v = p.uv.y() + 0.01 * random.Normal();
    p.uv = {u - std::floor(u), std::clamp(v, 0.0, 1.0)};
  }
  Write("head.csv", UvCsv(target));
  const auto fit = [&](const std::string& name, const std::string& more) {
    const auto outcome = Call(
        fmt::format("fit head.csv --set closure=periodic_u --out {} --quiet --set report=false {}",
                    name, more));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  };
  const auto result = [&](const std::string& name) {
    return nlohmann::json::parse(ReadFileBytes(folder_ / name / "result.json"));
  };
  const std::string rounds = "--set 'fit.plan={type: auto, relaxation_rounds: 3}'";
  EXPECT_THAT(fit("as_given", ""), ::testing::Not(HasSubstr("moved")));
  EXPECT_THAT(fit("moved", rounds), HasSubstr("(u,v) moved in "));
  EXPECT_FALSE(result("as_given").contains("moves"));
  const auto moves = result("moved")["moves"];
  EXPECT_GE(moves["rounds"], 1);
  EXPECT_GT(moves["rms_move_mm"], 0.01);
  EXPECT_LE(moves["coarse_rms_after_mm"], moves["coarse_rms_before_mm"]);
  EXPECT_LT(10 * result("moved")["median_mm"].get<double>(), result("as_given")["median_mm"]);
  fit("again", rounds + " --threads 2");
  for (const char* file : {"surface.hspline.json", "residuals.csv", "result.json"}) {
    EXPECT_EQ(ReadFileBytes(folder_ / "again" / file), ReadFileBytes(folder_ / "moved" / file));
  }
}

TEST_F(FitCommand, GivenUvStayWithoutARequest) {
  const FitTarget target = Scattered(FrankePoint, 500, 1e-3, 1);
  const PointTable table = ParsePointTable(UvCsv(target), "test");
  const PointFit result = FitPoints(table, {}, {});
  EXPECT_FALSE(result.moves);
  EXPECT_EQ(result.fit.uv, table.uv);
}

TEST_F(FitCommand, MovesBesideExactPointsAreRefused) {
  PointTable table = ParsePointTable(UvCsv(Scattered(FrankePoint, 500, 1e-3, 1)), "test");
  table.exact = {0};
  table.exact_normals = {Vec3::Zero()};
  PointFitOptions options;
  options.fit.plan = AutoPlan{.relaxation_rounds = 2};
  EXPECT_THAT(testing::WordsOf<InputError>([&] { FitPoints(table, options, {}); }),
              HasSubstr("fit.plan.relaxation_rounds: exact points"));
}

TEST_F(FitCommand, PointsOfEachFileFormatAreTheSame) {
  const FitTarget target = Scattered(FrankePoint, 300, 0, 1);
  std::string xyz, obj, ply = "ply\nformat ascii 1.0\nelement vertex 300\n";
  for (const char* name : {"x", "y", "z", "u", "v"}) {
    ply += fmt::format("property double {}\n", name);
  }
  ply += "end_header\n";
  for (const FitPoint& p : target.points) {
    const std::string place =
        fmt::format("{} {} {}", p.position.x(), p.position.y(), p.position.z());
    xyz += place + "\n";
    obj += "v " + place + "\n";
    ply += fmt::format("{} {} {}\n", place, p.uv.x(), p.uv.y());
  }
  Write("p.csv", UvCsv(target));
  Write("p.xyz", "# a scan\n" + xyz);
  Write("p.obj", obj + "f 1 2 3\n");
  Write("p.ply", ply);
  const PointFile csv = ReadPointFile(folder_ / "p.csv");
  for (const char* name : {"p.xyz", "p.obj", "p.ply"}) {
    EXPECT_EQ(ReadPointFile(folder_ / name).points.positions, csv.points.positions) << name;
  }
  EXPECT_EQ(ReadPointFile(folder_ / "p.ply").points.uv, csv.points.uv);
  EXPECT_THROW(ReadPointFile(folder_ / "p.doc"), IoError);
}

TEST_F(FitCommand, StandardInputIsATableOrIsRefused) {
  Write("a.csv", UvCsv(Scattered(FrankePoint, 500, 1e-3, 1)));
  ASSERT_EQ(Call("fit a.csv --out plain --quiet").code, 0);
  ASSERT_EQ(std::system(("gzip -kf '" + (folder_ / "a.csv").string() + "'").c_str()), 0);
  const auto outcome = Call("fit - --out piped --quiet < a.csv.gz");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(ReadFileBytes(folder_ / "piped/surface.hspline.json"),
            ReadFileBytes(folder_ / "plain/surface.hspline.json"));
  Write("a.npy", std::string("\x93NUMPY\x01\x00\x10\x00", 10));
  for (const std::string other : {"a.npy", "plain/surface.ply"}) {
    EXPECT_THAT(Call("fit - --out other --quiet < " + other).err,
                HasSubstr("standard input: it is not a CSV; give the file's name in place of -\n"));
  }
}

// Colours of 0..1 would be black as bytes.
TEST_F(FitCommand, OnlyBytesAreColours) {
  std::string csv = "x,y,z,u,v,red,green,blue\n";
  for (const FitPoint& p : Scattered(FrankePoint, 500, 1e-3, 1).points) {
    csv += fmt::format("{},{},{},{},{},{},{},0\n", p.position.x(), p.position.y(), p.position.z(),
                       p.uv.x(), p.uv.y(), p.uv.x(), p.uv.y());
  }
  Write("shares.csv", csv);
  const auto outcome = Call("fit shares.csv --out out --quiet --set attributes=[red,green,blue]");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const MeshAttributes carried =
      ReadPlyAttributes(ReadFileBytes(folder_ / "out/surface.ply"), "surface.ply");
  EXPECT_TRUE(carried.colors.empty());
  EXPECT_EQ(carried.scalars.size(), 3u);
}

// The table is larger than a block of the plain reader; with a blank the general reader takes over.
TEST_F(FitCommand, ALargeTableIsReadAsASmallOne) {
  std::string text = UvCsv(Scattered(FrankePoint, 60000, 1e-3, 1));
  ASSERT_GT(text.size(), 4u << 20);
  const auto expect_same = [&](const std::string& name) {
    Write(name, text);
    const PointFile file = ReadPointFile(folder_ / name);
    const PointTable table = ParsePointTable(text, name);
    EXPECT_EQ(file.sha256, Sha256OfText(text));
    EXPECT_EQ(file.points.positions.size(), 60000u);
    EXPECT_EQ(file.points.positions, table.positions);
    EXPECT_EQ(file.points.uv, table.uv);
  };
  expect_same("plain.csv");
  text.pop_back();  // the last line need not end
  expect_same("open.csv");
  text.insert(text.rfind(','), " ");
  expect_same("blank.csv");
}

// Triangles of every format are laid out; without triangles the same points are refused.
TEST_F(FitCommand, AScanThatFoldsIsLaidOut) {
  const auto bowl = [](const Vec2& uv) -> Vec3 {
    const Vec2 q = 2 * uv - Vec2(1, 1);
    const double t = 2 * q.cwiseAbs().maxCoeff(), p = std::atan2(q.y(), q.x());
    return 50 * Vec3(std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t));
  };
  const TriMesh mesh = testing::GridMesh(bowl, 40);
  for (const char* ending : {".ply", ".obj", ".stl", ".off"}) {
    Write(std::string("bowl") + ending, EncodeMesh(mesh, ending));
    const PointFile file = ReadPointFile(folder_ / (std::string("bowl") + ending));
    EXPECT_EQ(file.points.triangles.size(), mesh.triangles.size()) << ending;
    EXPECT_EQ(file.points.positions.size(), mesh.points.size()) << ending;
  }
  const auto outcome = Call("fit bowl.ply --out out --quiet");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("(u,v) by the mesh laid out by"));
  const auto json = nlohmann::json::parse(ReadFileBytes(folder_ / "out/result.json"));
  EXPECT_EQ(json["parameters"], "mesh");
  EXPECT_EQ(json["map"]["folded_share"], 0);
  EXPECT_LT(json["rms_mm"], 0.05);  // of a ball of 100 mm
  std::string csv = "x,y,z\n";
  for (const Vec3& p : mesh.points) {
    csv += fmt::format("{},{},{}\n", p.x(), p.y(), p.z());
  }
  Write("bowl.csv", csv);
  const auto alone = Call("fit bowl.csv --out alone --quiet");
  EXPECT_EQ(alone.code, 2);
  EXPECT_THAT(alone.err, HasSubstr("the points fold over the plane: "));
  EXPECT_THAT(alone.err,
              HasSubstr("or triangles between the points (a PLY, OBJ, STL or OFF with faces)"));
}

// Colours and heat over the surface, with two values of sigma, are written to every file.
TEST_F(FitCommand, FurtherColumnsAreFittedOverTheSurface) {
  Random random(1);
  std::string csv = "x,y,z,u,v,sigma,red,green,blue,heat\n";
  for (const FitPoint& p : Scattered(FrankePoint, 4000, 0, 1).points) {
    const double sigma = p.uv.x() < 0.5 ? 1e-3 : 4e-3;
    csv += fmt::format("{},{},{},{},{},{},{},{},{},{}\n", p.position.x(), p.position.y(),
                       p.position.z() + sigma * random.Normal(), p.uv.x(), p.uv.y(), sigma,
                       255 * p.uv.x(), 255 * p.uv.y(), 0, 300 + 5 * p.uv.x() + random.Normal());
  }
  Write("colours.csv", csv);
  const std::string names = " --set attributes=[red,green,blue,heat]";
  const auto outcome = Call("fit colours.csv --out out --quiet" + names);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(ReadFileBytes(folder_ / "out/result.json"));
  EXPECT_NEAR(json["sigma_factor"], 1, 0.1);
  EXPECT_NEAR(json["attributes"][3]["rms"], 1, 0.1);
  EXPECT_LT(json["attributes"][0]["rms"], 0.01);
  const std::string residuals = ReadFileBytes(folder_ / "out/residuals.csv");
  EXPECT_THAT(residuals, HasSubstr("outlier,weight,red,red_residual,green,green_residual"));
  const std::string ply = ReadFileBytes(folder_ / "out/surface.ply");
  const MeshAttributes carried = ReadPlyAttributes(ply, "surface.ply");
  ASSERT_EQ(carried.scalars.size(), 1u);
  EXPECT_EQ(carried.scalars[0].name, "heat");
  const TriMesh mesh = ReadPly(ply, "surface.ply");
  for (std::size_t k = 0; k < mesh.points.size(); k += 101) {
    EXPECT_NEAR(carried.scalars[0].values[k], 300 + 5 * mesh.points[k].x(), 0.5);
    EXPECT_NEAR(carried.colors[k][0], 255 * mesh.points[k].x(), 1);
  }
  EXPECT_EQ(ReadHSpline(folder_ / "out/attributes_2.hspline.json").shape().reference,
            OffsetReference::kWorld);
  for (const auto& file : fs::directory_iterator(folder_ / "out")) {
    EXPECT_TRUE(IsAmong(kPointFitFiles, file.path().filename().string())) << file.path();
  }
  EXPECT_THAT(Call("fit colours.csv --out none --quiet --set attributes=[red]").err,
              HasSubstr("'heat' is not a column"));  // colours are known, and without effect
  EXPECT_THAT(Call("fit colours.csv --out none --quiet --set attributes=[x]").err,
              HasSubstr("attributes: 'x' has a meaning of its own"));
}

// Single precision has steps of 0.5 there, ten times the chord.
TEST_F(FitCommand, TheChordHoldsFarFromTheOrigin) {
  std::string csv = "x,y,z,u,v\n";
  for (const FitPoint& p : Scattered(FrankePoint, 2000, 1e-3, 1).points) {
    csv += fmt::format("{},{},{},{},{}\n", 500000 + 100 * p.position.x(),
                       5400000 + 100 * p.position.y(), 100 * p.position.z(), p.uv.x(), p.uv.y());
  }
  Write("far.csv", csv);
  ASSERT_EQ(Call("fit far.csv --out far --quiet --set chord_mm=0.05").code, 0);
  ASSERT_EQ(Call("export far/surface.hspline.json --to far.obj --chord_mm 0.05").code, 0);
  const HSplineSurface surface = ReadHSpline(folder_ / "far/surface.hspline.json");
  const SurfaceProjector project(surface);
  for (const char* file : {"far/surface.ply", "far.obj"}) {
    const TriMesh mesh = ReadMesh(folder_ / file);
    for (std::size_t k = 0; k < mesh.points.size(); k += 37) {
      ASSERT_LT(project.Project(mesh.points[k]).distance_mm, 1e-4) << file;
    }
  }
}

TEST_F(FitCommand, InputFilesAreNotReplaced) {
  Write("own/residuals.csv", UvCsv(Scattered(FrankePoint, 300, 1e-3, 1)));
  Write("own/resolved.yaml", "chord_mm: 0.1\n");
  const auto refused = [&](const std::string& arguments, const std::string& file,
                           const std::string& folder) {
    const std::string before = ReadFileBytes(folder_ / file);
    const auto outcome = Call("fit " + arguments + " --force --quiet");
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_THAT(outcome.err, ::testing::AllOf(HasSubstr(file + ": this file is read"),
                                              HasSubstr("written into " + folder + ";"),
                                              HasSubstr("give another --out")));
    EXPECT_EQ(ReadFileBytes(folder_ / file), before);
    EXPECT_FALSE(fs::exists(folder_ / folder / ".semblance-part"));
  };
  refused("own/residuals.csv --out own", "own/residuals.csv", "own");
  refused(kFitConfigs + "/points.csv own/resolved.yaml --out own", "own/resolved.yaml", "own");
  fs::rename(folder_ / "own/residuals.csv", folder_ / "own/points.csv");
  EXPECT_EQ(Call("fit own/points.csv --out own --force --quiet").code, 0)
      << "points may lie beside what comes of them";
}

TEST_F(FitCommand, ForceLeavesNoResidualsOfAnEarlierFit) {
  const auto there = [&](const std::string& residuals) {
    const auto outcome = Call(fmt::format(
        "fit {}/points.csv --out out --force --quiet --set report=false --set residuals={}",
        kFitConfigs, residuals));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return std::pair(fs::exists(folder_ / "out/residuals.csv"),
                     fs::exists(folder_ / "out/residuals.ply"));
  };
  EXPECT_EQ(there("csv"), std::pair(true, false));
  EXPECT_EQ(there("ply"), std::pair(false, true));
  EXPECT_EQ(there("none"), std::pair(false, false));
  Write("out/residuals.csv", "x,y,z\n0,0,0\n");
  EXPECT_EQ(there("none"), std::pair(true, false)) << "it is no fit's";
}

TEST_F(FitCommand, ForceLeavesNoReportOrAttributesOfAnEarlierFit) {
  const FitTarget target = Scattered(FrankePoint, 400, 1e-3, 1);
  const auto fit = [&](const std::string& attributes, const std::string& options) {
    std::string points = fmt::format("x,y,z{}\n", attributes);
    for (const FitPoint& point : target.points) {
      const Vec3& p = point.position;
      points += fmt::format("{},{},{}", p.x(), p.y(), p.z());
      for (const char c : attributes) {
        points += c == ',' ? fmt::format(",{}", p.x()) : "";
      }
      points += "\n";
    }
    Write("points.csv", points);
    const auto outcome = Call("fit points.csv --out out --force --quiet " + options);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
  };
  const auto exists = [&](const char* name) { return fs::exists(folder_ / "out" / name); };
  fit(",a,b,c,d", "--set 'attributes=[a, b, c, d]'");
  EXPECT_TRUE(exists("report.html"));
  EXPECT_TRUE(exists("attributes_2.hspline.json"));
  Write("out/attributes_old.hspline.json", R"({"format":"semblance-hspline"})");
  fit(",a", "--set 'attributes=[a]' --set report=false");
  EXPECT_FALSE(exists("report.html"));
  EXPECT_TRUE(exists("attributes_1.hspline.json"));
  EXPECT_FALSE(exists("attributes_2.hspline.json"));
  EXPECT_TRUE(exists("attributes_old.hspline.json")) << "no fit writes that name";
  Write("out/report.html", "<html>mine</html>");
  fit("", "--set report=false");
  EXPECT_FALSE(exists("attributes_1.hspline.json"));
  EXPECT_TRUE(exists("report.html")) << "it is no fit's";
}

TEST_F(FitCommand, AWidthWithoutALossIsReported) {
  const auto outcome =
      Call(fmt::format("fit {}/points.csv --out out --quiet --set 'fit.terms=[{{type: points, "
                       "loss_width_mm: 3}}, {{type: smoothness, weight: auto, length_mm: 1}}]'",
                       kFitConfigs));
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("fit.terms[0].loss_width_mm: `loss: none` ignores it"));
}

TEST_F(FitCommand, AFaultIsOneLineAndNothingIsWritten) {
  Write("good.csv", "x,y,z\n0,0,0\n1,0,0\n0,1,0\n1,1,0\n");
  Write("bad.csv", "x,y,z\n0,0,zero\n");
  Write("line.csv", "x,y,z\n0,0,0\n1,0,0\n2,0,0\n");
  const auto refused = [&](const std::string& arguments, const std::string& words) {
    const auto outcome = Call("fit " + arguments + " --out out --quiet");
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_THAT(outcome.err, HasSubstr(words));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_FALSE(fs::exists(folder_ / "out" / "result.json"));
  };
  Write("plain.yaml", "parameters: auto\n");
  Write("cylinder.yaml", "parameters: cylinder\n");
  refused("bad.csv plain.yaml", "bad.csv:2: column 'z': 'zero'");
  refused("none.csv plain.yaml", "none.csv");
  refused("plain.yaml good.csv", "the points come first: semblance fit good.csv plain.yaml");
  refused("line.csv plain.yaml", "lie on a line");
  refused("good.csv --set chord_mm=1e-9", "chord_mm: 1e-09 is too fine");
  Write("franke.csv", UvCsv(Scattered(FrankePoint, 2000, 1e-3, 1)));
  refused("franke.csv --set chord_mm=1e-6", "chord_mm: 1e-06 is too fine for these points");
  Write("wide.csv", "x,y,z,u,v\n0,0,0,0,0\n1,0,0,2.5,0\n0,1,0,0,-1\n1,1,0,2,0\n");
  refused("wide.csv",
          "wide.csv:3: point 2 has (u,v) = (2.5, 0), outside [0, 1] x [0, 1]; to take all "
          "points, write parameters: {type: given, u_range: [0, 2.5], v_range: [-1, 1]}");
  refused("good.csv cylinder.yaml", "closure: periodic_u");
  refused("good.csv plain.yaml --set parameters=given", "columns u and v");
  refused("good.csv plain.yaml --set fit.terms[1].weight=some", "expected a number");
}

// Every plan, solver and extra on one tube with given (u,v).
TEST_F(FitCommand, ATubeIsFittedByEveryPlanThorough) {
  Write("head.csv", UvCsv(Scattered(HeadPoint, 3000, 1e-3, 1)));
  const std::string level_2 = "fit.plan={type: listed, schedule: [{level: 2}]}";
  const std::vector<std::pair<std::string, std::vector<std::string>>> ways = {
      {"untuned", {"sigma=true"}},
      {"ceres", {"fit.solver=ceres"}},
      {"adaptive", {"fit.plan={type: adaptive, tolerance_mm: 0.004, finest: 2}"}},
      {"listed", {level_2}},
      {"loss",
       {level_2,
        "fit.terms=[{type: points, loss: tukey, loss_width_mm: 0.1}, {type: smoothness, weight: "
        "1e-9}]"}},
      {"regions",
       {"fit.plan={type: adaptive, tolerance_mm: 0.1, finest: 2, regions: [{v: [0.9, 1], "
        "tolerance_mm: 0.004}]}"}},
      {"footpoint", {level_2, "fit.relaxation=footpoint"}},
      {"joint", {level_2, "fit.relaxation={type: joint, rounds: 1}"}}};
  for (const auto& [name, settings] : ways) {
    std::string call =
        "fit head.csv --quiet --set closure=periodic_u --set chord_mm=0.02 --set report=false";
    for (const std::string& setting : settings) {
      call += fmt::format(" --set '{}'", setting);
    }
    const auto outcome = Call(fmt::format("{} --out {}", call, name));
    ASSERT_EQ(outcome.code, 0) << name << ": " << outcome.err;
    const HSplineSurface surface = ReadHSpline(folder_ / name / "surface.hspline.json");
    EXPECT_EQ(surface.shape().closure, Closure::kPeriodicU);
    EXPECT_LT(ErrorAgainst(HeadPoint, surface, 60).rms, 0.05) << name;
    const TriMesh mesh = ReadMesh(folder_ / name / "surface.ply");
    const EdgeReport edges = CheckEdges(mesh);
    EXPECT_EQ(edges.non_manifold + edges.inconsistent, 0) << name;
    EXPECT_EQ(edges.boundary, 2 * std::ssize(mesh.points) - std::ssize(mesh.triangles)) << name;
  }
}

// The RMS is that of residuals.csv; the weighted RMS is shown too if the weights differ.
TEST_F(FitCommand, TheRmsIsThatOfTheDistances) {
  const FitTarget target = Scattered(FrankePoint, 2000, 1e-3, 1);
  const auto csv = [&](auto&& sigma) {
    std::string text = "x,y,z,u,v,sigma\n";
    for (std::size_t k = 0; k < target.points.size(); ++k) {
      const FitPoint& p = target.points[k];
      text += fmt::format("{},{},{},{},{},{}\n", p.position.x(), p.position.y(),
                          p.position.z() + (k % 10 == 0 ? 0.05 : 0), p.uv.x(), p.uv.y(), sigma(k));
    }
    return text;
  };
  Write("rough.csv", csv([](std::size_t k) { return k % 10 == 0 ? 0.05 : 1e-3; }));
  Write("alike.csv", csv([](std::size_t) { return 1e-3; }));
  for (const std::string name : {"rough", "alike"}) {
    const auto outcome = Call(fmt::format("fit {0}.csv --out {0}", name));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto json = nlohmann::json::parse(ReadFileBytes(folder_ / name / "result.json"));
    const PointFit fit =
        FitPoints(ParsePointTable(ReadFileBytes(folder_ / (name + ".csv")), name), {}, {});
    double sum = 0, count = 0;  // without the points that were left out
    for (std::uint32_t k = 0; k < 2000; ++k) {
      if (!std::ranges::binary_search(fit.fit.automatic->outliers, k)) {
        sum += fit.fit.residual_mm[k] * fit.fit.residual_mm[k];
        ++count;
      }
    }
    const double rms = std::sqrt(sum / count);
    EXPECT_NEAR(json["rms_mm"].get<double>(), rms, 1e-9);
    EXPECT_THAT(outcome.out, HasSubstr(fmt::format("RMS {:.4g}, largest", rms)));
    EXPECT_THAT(outcome.out, HasSubstr("solver: conjugate gradients\n"));
    const bool differ = name == "rough";
    ASSERT_EQ(json.contains("weighted_rms_mm"), differ);
    if (differ) {
      EXPECT_LT(json["weighted_rms_mm"].get<double>(), 0.5 * rms);
    }
    EXPECT_EQ(outcome.out.find("weighted RMS") != std::string::npos, differ);
    EXPECT_EQ(outcome.out.find("of a point of mean weight") != std::string::npos, differ);
    const std::string page = ReadFileBytes(folder_ / name / "report.html");
    EXPECT_EQ(page.find("weighted RMS") != std::string::npos, differ);
  }
}

}  // namespace
}  // namespace semblance::problems
