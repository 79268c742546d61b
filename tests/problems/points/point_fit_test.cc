// SPDX-License-Identifier: GPL-3.0-or-later
// `semblance fit`: any scattered points, with and without (u,v).
#include "problems/points/point_fit.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "problems/config/config.h"
#include "problems/output/given_files.h"
#include "problems/output/manifest.h"
#include "problems/points/fit_report.h"
#include "problems/points/point_files.h"
#include "problems/points/residual_files.h"
#include "surfaces/base/random.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "surfaces/mesh_files/read_ply.h"
#include "tests/testing/grid_mesh.h"
#include "tests/testing/program_call.h"
#include "tests/testing/scattered_data.h"
#include "tests/testing/scratch_file.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using testing::ErrorAgainst;
using testing::FrankePoint;
using ::testing::HasSubstr;
using testing::HeadPoint;
using testing::Scattered;

const std::string kProgram = SEMBLANCE_PROGRAM;
const std::string kConfigs = SEMBLANCE_SOURCE_DIR "/configs/fit";

std::string Csv(const FitTarget& target, bool with_uv) {
  std::string csv = with_uv ? "x,y,z,u,v\n" : "x,y,z\n";
  for (const FitPoint& p : target.points) {
    csv += fmt::format("{},{},{}", p.position.x(), p.position.y(), p.position.z());
    csv += with_uv ? fmt::format(",{},{}\n", p.uv.x(), p.uv.y()) : "\n";
  }
  return csv;
}

PointTable TableOf(const FitTarget& target) {
  return ParsePointTable(Csv(target, /*with_uv=*/false), "test");
}

class PointFitCommand : public ::testing::Test {
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

TEST_F(PointFitCommand, FrankesFunctionAndTheHeadComeOut) {
  Write("franke.csv", Csv(Scattered(FrankePoint, 10000, 1e-3, 1), true));
  Write("head.csv", Csv(Scattered(HeadPoint, 30000, 1e-4, 1), true));
  for (const char* name : {"franke", "head"}) {
    const auto outcome =
        Call(fmt::format("fit {0}.csv {1}/{0}.yaml --out {0} --quiet", name, kConfigs));
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

// Neither a configuration nor (u,v): what is left of the points is their noise, 1e-3 each way.
TEST_F(PointFitCommand, AHeightFieldKeepsItsNoise) {
  Write("franke.csv", Csv(Scattered(FrankePoint, 5000, 1e-3, 1), /*with_uv=*/false));
  const auto outcome =
      Call(fmt::format("fit franke.csv {}/height_field.yaml --out out --quiet", kConfigs));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(ReadFileBytes(folder_ / "out/result.json"));
  const double noise = std::sqrt(3) * 1e-3;
  EXPECT_GT(json["rms_mm"], 0.8 * noise);
  EXPECT_LT(json["rms_mm"], 1.1 * noise);
}

TEST_F(PointFitCommand, TheTableOfTheReadmeIsFittedWithoutAConfiguration) {
  const auto outcome =
      Call(fmt::format("fit {}/points.csv --set residuals=ply --out out --quiet", kConfigs));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("outliers left out"));
  EXPECT_TRUE(fs::exists(folder_ / "out/residuals.ply"));
  EXPECT_FALSE(fs::exists(folder_ / "out/residuals.csv"));
  const auto json = nlohmann::json::parse(ReadFileBytes(folder_ / "out/result.json"));
  EXPECT_NEAR(json["automatic"]["noise_mm"], 2e-3, 2e-4);
  EXPECT_NEAR(json["automatic"]["outlier_count"], 20, 2);
}

// (u,v) that are off by a hundredth blur the head; moved first, they do not.
TEST_F(PointFitCommand, UvMoveBeforeTheFitWhereThatIsAskedFor) {
  FitTarget target = Scattered(HeadPoint, 8000, 1e-4, 1);
  Random random(2);
  for (FitPoint& p : target.points) {
    const double u = p.uv.x() + 0.01 * random.Normal(), v = p.uv.y() + 0.01 * random.Normal();
    p.uv = {u - std::floor(u), std::clamp(v, 0.0, 1.0)};
  }
  Write("head.csv", Csv(target, /*with_uv=*/true));
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

TEST_F(PointFitCommand, GivenUvStayUnlessAskedFor) {
  const FitTarget target = Scattered(FrankePoint, 500, 1e-3, 1);
  const PointTable table = ParsePointTable(Csv(target, /*with_uv=*/true), "test");
  const PointFit result = FitPoints(table, {}, {});
  EXPECT_FALSE(result.moves);
  EXPECT_EQ(result.fit.uv, table.uv);
}

TEST_F(PointFitCommand, MovesBesideExactPointsAreRefused) {
  PointTable table = ParsePointTable(Csv(Scattered(FrankePoint, 500, 1e-3, 1), true), "test");
  table.exact = {0};
  table.exact_normals = {Vec3::Zero()};
  PointFitOptions options;
  options.fit.plan = AutoPlan{.relaxation_rounds = 2};
  EXPECT_THAT(testing::WordsOf<InputError>([&] { FitPoints(table, options, {}); }),
              HasSubstr("fit.plan.relaxation_rounds: exact points"));
}

TEST_F(PointFitCommand, PointsOfEachKindOfFileAreTheSame) {
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
  Write("p.csv", Csv(target, /*with_uv=*/true));
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

// Larger than what is read at once; with a blank somewhere it goes by the general reader.
TEST_F(PointFitCommand, ALargeTableIsReadAsASmallOne) {
  std::string text = Csv(Scattered(FrankePoint, 60000, 1e-3, 1), /*with_uv=*/true);
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

// Triangles in whatever file they stand; without them the same points are refused.
TEST_F(PointFitCommand, AScanThatFoldsNeedsItsTriangles) {
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
  const auto refused = Call("fit bowl.csv --out none --quiet");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("fold over every plane"));
}

// Colours and heat over the surface, each point surer or less sure; out in every file of points.
TEST_F(PointFitCommand, FurtherColumnsAreFittedOverTheSurface) {
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
  EXPECT_THAT(residuals, HasSubstr("outlier,red,red_residual,green,green_residual"));
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
              HasSubstr("'green' is no column"));
  EXPECT_THAT(Call("fit colours.csv --out none --quiet --set attributes=[x]").err,
              HasSubstr("attributes: 'x' has a meaning of its own"));
}

// The two tables of docs/fit.md: the second patch continues the first.
TEST_F(PointFitCommand, AJoinIsToldInEveryPlace) {
  ASSERT_EQ(Call(fmt::format("fit {}/left.csv --out left --quiet", kConfigs)).code, 0);
  const auto outcome =
      Call(fmt::format("fit {}/right.csv --out right --quiet --set "
                       "'joins=[{{surface: left/surface.hspline.json, edge: u0, its_edge: u1}}]'",
                       kConfigs));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const std::string line = "u0 joined to u1 of left/surface.hspline.json (tangent_plane, ";
  EXPECT_THAT(outcome.out, HasSubstr(line));
  EXPECT_THAT(outcome.out, ::testing::Not(HasSubstr("that is more than")));
  EXPECT_THAT(ReadFileBytes(folder_ / "right/report.html"), HasSubstr(line));
  const auto json = nlohmann::json::parse(ReadFileBytes(folder_ / "right/result.json"));
  EXPECT_EQ(json["points"], 800);
  ASSERT_EQ(json["joins"].size(), 1u);
  EXPECT_EQ(json["joins"][0]["surface_sha256"],
            Sha256OfFile(folder_ / "left/surface.hspline.json"));
  EXPECT_LT(json["joins"][0]["largest_gap_mm"], 1e-9);
  EXPECT_LT(json["joins"][0]["largest_angle_deg"], 0.1);
  EXPECT_EQ(json["joins"][0]["holds"], true);
  const std::string residuals = ReadFileBytes(folder_ / "right/residuals.csv");
  EXPECT_EQ(std::count(residuals.begin(), residuals.end(), '\n'), 801);
  const auto again = Call(fmt::format(
      "fit {}/right.csv right/resolved.yaml --out again --quiet --threads 2", kConfigs));
  ASSERT_EQ(again.code, 0) << again.err;
  for (const char* file : {"surface.hspline.json", "result.json", "report.html"}) {
    EXPECT_EQ(ReadFileBytes(folder_ / "again" / file), ReadFileBytes(folder_ / "right" / file));
  }
}

TEST_F(PointFitCommand, AJoinThatCannotBeIsRefusedInOneLine) {
  Write("xyz.csv", Csv(Scattered(FrankePoint, 300, 1e-3, 1), /*with_uv=*/false));
  Write("no.json", "{}");
  ASSERT_EQ(Call(fmt::format("fit {}/left.csv --out left --quiet", kConfigs)).code, 0);
  const auto refused = [&](const std::string& points, const std::string& options,
                           const std::string& words) {
    const auto outcome =
        Call(fmt::format("fit {} --out out --quiet --set 'joins=[{{{}", points, options));
    EXPECT_EQ(outcome.code, 2) << options;
    EXPECT_THAT(outcome.err, HasSubstr(words));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_FALSE(fs::exists(folder_ / "out" / "result.json"));
  };
  const std::string right = kConfigs + "/right.csv", left = "surface: left/surface.hspline.json";
  refused(right, "surface: none.json}]'", "none.json");
  refused(right, "surface: no.json}]'", "no.json: not an H-spline");
  refused("xyz.csv", left + "}]'", "joins: an edge of the new surface is where its points' own");
  refused(right, left + ", reversed: true}]'", "write reversed: false");
  refused(right, left + "}]' --set fit.plan.type=listed", "joins: edges are held with fit.plan");
  const auto checked = Call("check left/resolved.yaml --set 'joins=[{surface: none.json}]'");
  EXPECT_EQ(checked.code, 2);
  EXPECT_THAT(checked.out + checked.err, HasSubstr("joins[0].surface"));
}

// Single precision has steps of 0.5 there, ten times the chord.
TEST_F(PointFitCommand, TheChordHoldsFarFromTheOrigin) {
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

TEST_F(PointFitCommand, NothingThatItReadsIsReplaced) {
  Write("own/residuals.csv", Csv(Scattered(FrankePoint, 300, 1e-3, 1), /*with_uv=*/true));
  Write("own/resolved.yaml", "chord_mm: 0.1\n");
  ASSERT_EQ(Call(fmt::format("fit {}/left.csv --out left --quiet", kConfigs)).code, 0);
  const auto refused = [&](const std::string& arguments, const std::string& file,
                           const std::string& folder) {
    const std::string before = ReadFileBytes(folder_ / file);
    const auto outcome = Call("fit " + arguments + " --force --quiet");
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_THAT(outcome.err, ::testing::AllOf(HasSubstr(file + ": it is read here"),
                                              HasSubstr("written into " + folder + ";"),
                                              HasSubstr("give another --out")));
    EXPECT_EQ(ReadFileBytes(folder_ / file), before);
    EXPECT_FALSE(fs::exists(folder_ / folder / ".semblance-part"));
  };
  refused("own/residuals.csv --out own", "own/residuals.csv", "own");
  refused(kConfigs + "/points.csv own/resolved.yaml --out own", "own/resolved.yaml", "own");
  refused(kConfigs +
              "/right.csv --out left --set "
              "'joins=[{surface: left/surface.hspline.json, edge: u0, its_edge: u1}]'",
          "left/surface.hspline.json", "left");
  fs::rename(folder_ / "own/residuals.csv", folder_ / "own/points.csv");
  EXPECT_EQ(Call("fit own/points.csv --out own --force --quiet").code, 0)
      << "points may lie beside what comes of them";
}

TEST_F(PointFitCommand, WhatIsWrongIsSaidInOneLineAndNothingIsWritten) {
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
  Write("franke.csv", Csv(Scattered(FrankePoint, 2000, 1e-3, 1), /*with_uv=*/true));
  refused("franke.csv --set chord_mm=1e-6", "chord_mm: 1e-06 is too fine for these points");
  Write("wide.csv", "x,y,z,u,v\n0,0,0,0,0\n1,0,0,2.5,0\n0,1,0,0,-1\n1,1,0,2,0\n");
  refused("wide.csv",
          "wide.csv:3: point 2 has (u,v) = (2.5, 0), outside [0, 1] x [0, 1]; to take all "
          "points, write parameters: {type: given, u_range: [0, 2.5], v_range: [-1, 1]}");
  refused("good.csv cylinder.yaml", "closure: periodic_u");
  refused("good.csv plain.yaml --set parameters=given", "columns u and v");
  refused("good.csv plain.yaml --set fit.terms[1].weight=some", "expected a number");
}

// A height field that is turned in space, without (u,v): the plane is found.
TEST(PointFit, PlaneParametersFindTheHeightField) {
  const Mat3 turn = Eigen::AngleAxisd(0.8, Vec3(1, -2, 0.5).normalized()).matrix();
  const auto surface = [&](const Vec2& uv) -> Vec3 {
    return turn * Vec3(150 * uv.x(), 100 * uv.y(), 8 * std::sin(5 * uv.x()) * std::cos(4 * uv.y()));
  };
  PointFitOptions options;
  options.fit.terms = {PointTerm{}};
  options.fit.plan = AdaptivePlan{.tolerance_mm = 0.01, .finest = 3};
  const PointFit result = FitPoints(TableOf(Scattered(surface, 5000, 0, 3)), options, {});
  EXPECT_EQ(result.parameters, "plane");
  const SurfaceProjector projector(result.fit.surface);
  for (const FitPoint& p : Scattered(surface, 100, 0, 4).points) {
    if ((p.uv - Vec2(0.5, 0.5)).cwiseAbs().maxCoeff() < 0.45) {
      EXPECT_LT(projector.Project(p.position).distance_mm, 0.02);
    }
  }
}

TEST(PointFit, CylinderParametersCloseTheHead) {
  const PointFitOptions options{
      .closure = Closure::kPeriodicU,
      .parameters = CylinderParameters{.axis = {0, 0, 1}},
      .fit = {.plan = AdaptivePlan{.tolerance_mm = 4e-3, .finest = 3},
              .terms = {PointTerm{}, SmoothnessTerm{.weight = 1e-9, .length_mm = 1}}}};
  const PointFit result = FitPoints(TableOf(Scattered(HeadPoint, 30000, 1e-4, 3)), options, {});
  EXPECT_EQ(result.parameters, "cylinder");
  EXPECT_LT(result.fit.point_rms_mm, 4e-3);
  for (const double v : {0.1, 0.5, 0.9}) {
    const Vec2 left(1 - 1e-9, v), right(1e-9, v);
    EXPECT_LT((result.fit.surface.Point(left) - result.fit.surface.Point(right)).norm(), 1e-6);
  }
}

// A ring without (u,v), turned: the torus is found, and the surface closes both ways.
TEST(PointFit, TorusParametersCloseTheRingBothWays) {
  const Mat3 turn = Eigen::AngleAxisd(0.8, Vec3(1, -2, 0.5).normalized()).matrix();
  const auto ring = [&](const Vec2& uv) -> Vec3 { return 30 * (turn * testing::RingPoint(uv)); };
  const PointTable table = TableOf(Scattered(ring, 20000, 0.01, 3));
  for (const Parameters& parameters :
       {Parameters(AutoParameters{}), Parameters(TorusParameters{})}) {
    const PointFit result =
        FitPoints(table, {.closure = Closure::kPeriodicUv, .parameters = parameters}, {});
    EXPECT_EQ(result.parameters, "torus");
    EXPECT_THAT(result.Faults(), ::testing::IsEmpty());
    EXPECT_LT(result.fit.point_rms_mm, 0.02);
    const SurfaceProjector projector(result.fit.surface);
    for (const FitPoint& p : Scattered(ring, 200, 0, 4).points) {
      EXPECT_LT(projector.Project(p.position).distance_mm, 0.02);
    }
    for (const double other : {0.0, 0.4, 0.97}) {
      const HSplineSurface& surface = result.fit.surface;
      EXPECT_LT((surface.Point({1 - 1e-12, other}) - surface.Point({0, other})).norm(), 1e-8);
      EXPECT_LT((surface.Point({other, 1 - 1e-12}) - surface.Point({other, 0})).norm(), 1e-8);
    }
  }
}

// Every plan, solver and extra on one torus with given (u,v).
TEST_F(PointFitCommand, ATorusIsFittedByEveryPlan) {
  Write("ring.csv", Csv(Scattered(testing::RingPoint, 3000, 1e-3, 1), /*with_uv=*/true));
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
    std::string call = "fit ring.csv --quiet --set closure=periodic_uv --set chord_mm=0.02";
    for (const std::string& setting : settings) {
      call += fmt::format(" --set '{}'", setting);
    }
    const auto outcome = Call(fmt::format("{} --out {}", call, name));
    ASSERT_EQ(outcome.code, 0) << name << ": " << outcome.err;
    const HSplineSurface surface = ReadHSpline(folder_ / name / "surface.hspline.json");
    EXPECT_EQ(surface.shape().closure, Closure::kPeriodicUv);
    EXPECT_LT(ErrorAgainst(testing::RingPoint, surface, 60).rms, 0.05) << name;
    const TriMesh mesh = ReadMesh(folder_ / name / "surface.ply");
    const EdgeReport edges = CheckEdges(mesh);
    EXPECT_EQ(edges.boundary + edges.non_manifold + edges.inconsistent, 0) << name;
    EXPECT_EQ(2 * mesh.points.size(), mesh.triangles.size()) << name;
  }
}

// Noise of 1e-3 and twenty points a parameter or so: sigma is a fraction of it, and more at
// borders.
TEST(PointFit, SigmaIsKnownWhereItIsAskedFor) {
  PointFitOptions options;
  options.sigma = true;
  const PointTable table =
      ParsePointTable(Csv(Scattered(FrankePoint, 3000, 1e-3, 1), /*with_uv=*/true), "test");
  const PointFit result = FitPoints(table, options, {});
  ASSERT_EQ(result.sigma_mm.size(), 3000u);
  EXPECT_EQ(result.sigma->At(result.fit.uv), result.sigma_mm);
  const std::vector<Vec2> places = {{0.5, 0.5}, {0, 0}};
  const std::vector<double> sigma = result.sigma->At(places);
  EXPECT_GT(sigma[0], 1e-5);
  EXPECT_LT(sigma[0], 6e-4);
  EXPECT_GT(sigma[1], sigma[0]);
  EXPECT_THAT(ResidualsCsv({result.fit, {}, {}, result.sigma_mm}),
              ::testing::StartsWith("point,u,v,residual_mm,outlier,sigma_mm\n"));
  EXPECT_THAT(ResidualsPly({result.fit, {}, {}, result.sigma_mm}),
              HasSubstr("property float sigma_mm"));
  options.sigma = false;
  const PointFit plain = FitPoints(table, options, {});
  EXPECT_EQ(plain.fit.residual_mm, result.fit.residual_mm);
  EXPECT_THAT(plain.sigma_mm, ::testing::IsEmpty());
}

// Every hundredth point lifted, and to be met all the same.
TEST(PointFit, ExactPointsOfATableAreMet) {
  const FitTarget target = Scattered(FrankePoint, 2000, 1e-3, 1);
  std::string csv = "x,y,z,u,v,exact,nx,ny,nz\n";
  for (std::size_t k = 0; k < target.points.size(); ++k) {
    const FitPoint& p = target.points[k];
    csv += fmt::format("{},{},{},{},{},{},0,0,{}\n", p.position.x(), p.position.y(),
                       p.position.z() + (k % 100 == 0 ? 0.01 : 0), p.uv.x(), p.uv.y(),
                       k % 100 == 0 ? 1 : 0, k == 0 ? 1 : 0);
  }
  const PointTable table = ParsePointTable(csv, "test");
  ASSERT_EQ(table.exact.size(), 20u);
  PointFitOptions options;
  options.sigma = true;
  const PointFit result = FitPoints(table, options, {});
  std::vector<double> sigma_mm = result.sigma_mm;
  std::nth_element(sigma_mm.begin(), sigma_mm.begin() + 1000, sigma_mm.end());
  for (const std::uint32_t k : table.exact) {
    EXPECT_LT((result.fit.surface.Point(table.uv[k]) - table.positions[k]).norm(), 1e-9);
    EXPECT_LT(result.sigma_mm[k], 1e-2 * sigma_mm[1000]);
  }
  EXPECT_LT(std::abs(result.fit.surface.Frame(table.uv[0]).du.z()), 1e-9);
  EXPECT_LT(ErrorAgainst(FrankePoint, result.fit.surface, 50).rms, 0.01);
}

// One point in five is twenty times as rough as the others, and says so; one in fifty is far off
// and claims to be the surest of all. 1 is what the others are off by.
TEST(PointFit, SigmaFactorsAreOfThePointsThatAreNoOutliers) {
  const FitTarget target = Scattered(FrankePoint, 5000, 0, 1);
  Random random(2);
  std::string csv = "x,y,z,u,v,sigma\n";
  for (int k = 0; k < 5000; ++k) {
    const bool gross = k % 50 == 7;
    const double sigma = k % 5 == 0 ? 2e-2 : 1e-3;
    const Vec3 noise = sigma * Vec3(random.Normal(), random.Normal(), random.Normal());
    const Vec3 position = target.points[k].position + noise + Vec3(0, 0, gross ? 0.5 : 0);
    const Vec2& uv = target.points[k].uv;
    csv += fmt::format("{},{},{},{},{},{}\n", position.x(), position.y(), position.z(), uv.x(),
                       uv.y(), gross ? 2e-4 : sigma);
  }
  const PointFit result = FitPoints(ParsePointTable(csv, "test"), {}, {});
  EXPECT_NEAR(result.sigma_factor, 1, 0.03);
  EXPECT_NEAR(static_cast<double>(result.fit.automatic->outliers.size()), 100, 5);
}

// As residuals.csv has it, and beside it with weights, where those differ.
TEST_F(PointFitCommand, TheRmsIsThatOfTheDistances) {
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
    double sum = 0;
    for (const double distance : fit.fit.residual_mm) {
      sum += distance * distance;
    }
    const double rms = std::sqrt(sum / 2000);
    EXPECT_NEAR(json["rms_mm"].get<double>(), rms, 1e-9);
    EXPECT_THAT(outcome.out, HasSubstr(fmt::format("RMS {:.4g} mm, largest", rms)));
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

// With the weight that was found, its length and the same points, a fit that is given numbers is
// the same.
TEST(PointFit, TheWeightThatIsReportedIsThatOfTheTermsAsWritten) {
  const PointTable table =
      ParsePointTable(Csv(Scattered(FrankePoint, 3000, 1e-3, 1), /*with_uv=*/true), "test");
  const PointFit plain = FitPoints(table, {}, {});
  PointFitOptions options;
  const auto ask = [&](AutoOr<double> weight) {
    options.fit.terms = {PointTerm{.weight = 7},
                         SmoothnessTerm{.weight = weight, .length_mm = 0.1}};
  };
  ask(AutoOr<double>::Auto());
  const PointFit found = FitPoints(table, options, {});
  EXPECT_EQ(found.fit.residual_mm, plain.fit.residual_mm);
  const AutoReport& report = *found.fit.automatic;
  EXPECT_EQ(report.length_mm, 0.1);
  EXPECT_NEAR(report.weight / plain.fit.automatic->weight, 7e4, 1);
  EXPECT_EQ(AutoJson(report)["length_mm"], 0.1);
  options.fit.solver = Solver::kCeres;
  const PointFit settled = FitPoints(table, options, {});
  ask(report.weight);
  const PointFit again = FitPoints(table, options, {});
  const auto of_settled = [&](const Vec2& uv) { return settled.fit.surface.Point(uv); };
  EXPECT_LT(ErrorAgainst(of_settled, again.fit.surface, 50).rms, 1e-9);
}

// Two strips of points, and next to nothing between them.
TEST(PointFit, ASurfaceThatSwingsFarBeyondItsPointsCannotBeUsed) {
  std::string csv = "x,y,z,u,v\n";
  for (int k = 0; k < 400; ++k) {
    const double u = k % 20 / 200.0 + (k < 200 ? 0.0 : 0.9), v = k / 20 / 19.0;
    const double noise = k * 7919 % 13 / 13.0;
    csv += fmt::format("{},{},{},{},{}\n", u, v, 0.1 * noise, u, v);
  }
  const PointTable table = ParsePointTable(csv, "test");
  PointFitOptions options;
  EXPECT_LT(FitPoints(table, options, {}).reach, 1);
  options.fit.plan = ListedPlan{{{.level = 0}, {.level = 1}, {.level = 2}}};
  options.fit.terms = {PointTerm{}, SmoothnessTerm{.weight = 1e-16}};
  const PointFit result = FitPoints(table, options, {});
  EXPECT_GT(result.reach, 3);
  ASSERT_EQ(result.Faults().size(), 1u);
  EXPECT_THAT(result.Faults()[0], HasSubstr("times the points' extent beyond them"));
}

// Inside a ball there is no surface to find; on its upper half there is, however noisy.
TEST(PointFit, PointsThatFillSpaceCannotBeUsed) {
  Random random(7);
  PointTable filled, half;
  for (int k = 0; k < 3000; ++k) {
    filled.positions.push_back(50 * std::cbrt(random.Uniform(0, 1)) * random.Direction());
    const Vec3 on = random.Direction();
    half.positions.emplace_back(50 * on.x(), 50 * on.y(), 20 * std::abs(on.z()) + random.Normal());
  }
  const PointFit result = FitPoints(filled, {}, {});
  EXPECT_GT(result.off, 0.1);
  ASSERT_EQ(result.Faults().size(), 1u);
  EXPECT_THAT(result.Faults()[0], HasSubstr("fill space"));
  const PointFit noisy = FitPoints(half, {}, {});
  EXPECT_LT(noisy.off, 0.02);
  EXPECT_THAT(noisy.Faults(), ::testing::IsEmpty());
}

TEST(PointFit, WhatThePlanCannotIsToldWhenTheFileIsRead) {
  const auto read = [](const std::string& text) {
    return testing::WordsOf<ConfigError>([&] { ReadConfigText<PointFitOptions>(text, "x.yaml"); });
  };
  EXPECT_THAT(read("fit: {plan: adaptive, terms: [symmetry]}\n"),
              HasSubstr("fit.terms: the adaptive plan has no term 'points'"));
  EXPECT_THAT(read("fit: {terms: [symmetry]}\n"),
              HasSubstr("the auto plan weighs 'points' without a loss"));
  EXPECT_THAT(read("fit: {terms: [points]}\n"),
              HasSubstr("fit.terms: the auto plan always weighs a 'smoothness'; add"));
  EXPECT_THAT(read("fit: {solver: ceres, terms: [points]}\n"),
              HasSubstr("fit.terms: the auto plan always weighs a 'smoothness'; add"));
  EXPECT_THAT(read("fit: {terms: [points, points, {type: smoothness, weight: auto}]}\n"),
              HasSubstr("fit.terms[1]: the auto plan weighs one 'points'"));
  EXPECT_THAT(read("parameters: cylinder\n"), HasSubstr("closure: parameters on a cylinder"));
  EXPECT_THAT(read("parameters: cylinder\nclosure: periodic_uv\n"),
              HasSubstr("go round in u alone; write closure: periodic_u"));
  EXPECT_THAT(read("parameters: torus\nclosure: periodic_u\n"),
              HasSubstr("closure: parameters on a torus go round both ways"));
  EXPECT_THAT(read("parameters: mesh\nclosure: periodic_uv\n"), HasSubstr("do not go round"));
  EXPECT_THAT(read("patches_v: 3\nclosure: periodic_uv\n"),
              HasSubstr("patches_v: H-spline: 8 x 3 patches are not allowed"));
  EXPECT_THAT(read("parameters: plane\nclosure: periodic_u\n"), HasSubstr("do not go round"));
  EXPECT_THAT(read("patches_u: 1\nclosure: periodic_u\n"), HasSubstr("patches_u: H-spline: 1 x 8"));
  // What is said to be allowed is.
  EXPECT_THAT(read("patches_u: 3\nclosure: periodic_u\n"), HasSubstr("use 4..8192 x 1..8192"));
  EXPECT_NO_THROW(ReadConfigText<PointFitOptions>("patches_u: 8192\n", "x.yaml"));
  EXPECT_NO_THROW(ReadConfigText<PointFitOptions>("patches_u: 1024\npatches_v: 1024\n", "x.yaml"));
  EXPECT_THAT(
      read("patches_u: 4096\npatches_v: 4096\n"),
      HasSubstr("patches_u: 4096 x 4096 patches have 16801801 control vertices; level 0 may "
                "have 1100000; take fewer patches"));
  for (const char* term : {"landmarks", "prior_shape", "spring", "non_penetration"}) {
    EXPECT_THAT(read(fmt::format("fit: {{plan: until, terms: [points, {}]}}\n", term)),
                HasSubstr("and points of a file have none"));
  }
  for (const char* rule : {"free", "frozen", "{type: weighted, weight: 3}"}) {
    EXPECT_THAT(read(fmt::format("fit: {{features: {}}}\n", rule)),
                HasSubstr("fit.features: a surface through points of a file has no features"));
  }
  EXPECT_THAT(read("fit: {relaxation: footpoint}\n"), HasSubstr("fit.relaxation: the auto plan"));
  EXPECT_THAT(read("fit: {plan: {type: auto, relaxation_rounds: 2}}\n"
                   "joins: [{surface: a.json, edge: u0, its_edge: u1}]\n"),
              HasSubstr("fit.plan.relaxation_rounds: joins need"));
  EXPECT_THAT(read("fit: {plan: {type: adaptive, relaxation_rounds: 2}}\n"),
              HasSubstr("fit.plan.relaxation_rounds"));
  EXPECT_THAT(read("fit: {plan: {type: adaptive, sweeps: 1}}\n"), HasSubstr("fit.plan.sweeps"));
  EXPECT_THAT(read("fit: {plan: {type: adaptive, regions: [{u: [0.5, 0.2]}]}}\n"),
              HasSubstr("fit.plan.regions[0]"));
  EXPECT_THAT(read("sigma: true\nfit: {plan: adaptive}\n"), HasSubstr("sigma: it follows"));
}

TEST(PointFit, OutliersAreCountedInEnglish) {
  AutoReport report;
  report.noise_mm = 1;
  EXPECT_THAT(AutoText(report), ::testing::Not(HasSubstr("left out")));
  report.outliers = {7};
  EXPECT_THAT(AutoText(report), HasSubstr("1 outlier left out; residuals and result.json list it"));
  report.outliers = {7, 9};
  EXPECT_THAT(AutoText(report), HasSubstr("2 outliers left out"));
}

TEST(PointFit, ConfigurationRoundTrips) {
  const auto options = ReadConfig<PointFitOptions>(kConfigs + "/scan.yaml");
  EXPECT_TRUE(std::get<SmoothnessTerm>(options.fit.terms[1]).weight.automatic);
  const auto again = ReadConfigText<PointFitOptions>(WriteConfig(options), "x.yaml");
  EXPECT_EQ(WriteConfig(again), WriteConfig(options));
  EXPECT_THAT(OptionsReference<PointFitOptions>(), HasSubstr("number or auto"));
  const auto schema = nlohmann::json::parse(OptionsSchema<PointFitOptions>());
  EXPECT_TRUE(schema["properties"].contains("parameters"));
}

}  // namespace
}  // namespace semblance
