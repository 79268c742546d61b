// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/fit_trim.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "problems/points/point_fit.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/program_call.h"
#include "tests/testing/scratch_file.h"

namespace semblance {
namespace {

using ::testing::HasSubstr;

// A disc of radius 40 mm with a hole of 15 mm, on a gentle hill, and one point far above.
std::vector<Vec3> Ring(int count) {
  Random random(3);
  std::vector<Vec3> points;
  while (std::ssize(points) < count) {
    const Vec2 p(random.Uniform(-40, 40), random.Uniform(-40, 40));
    if (p.norm() < 40 && p.norm() > 15) {
      points.emplace_back(p.x(), p.y(), 0.002 * p.squaredNorm() + random.Uniform(-0.03, 0.03));
    }
  }
  points.emplace_back(0, 0, 60);
  return points;
}

std::string CsvOf(const std::vector<Vec3>& points) {
  std::string csv = "x,y,z\n";
  for (const Vec3& p : points) {
    csv += fmt::format("{},{},{}\n", p.x(), p.y(), p.z());
  }
  return csv;
}

class FitTrim : public ::testing::Test {
 protected:
  // A fit of ring.csv into a folder of that name.
  testing::Outcome Fit(const std::string& name, const std::string& options) {
    return testing::CallProgram(
        folder_, fmt::format("fit ring.csv --out {} --set parameters=plane {}", name, options));
  }
  void SetUp() override { WriteFileAtomically(folder_ / "ring.csv", CsvOf(Ring(4000))); }
  testing::ScratchFolder folder_;
};

// The outlier keeps nothing of the hole.
TEST_F(FitTrim, LeavesWhatIsNearThePoints) {
  const auto untrimmed = Fit("whole", "");
  ASSERT_EQ(untrimmed.code, 0) << untrimmed.err;
  const auto outcome = Fit("ring", "--set trim=cloud");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("% of the surface is left out"));
  const TriMesh whole = ReadMesh(folder_ / "whole/surface.ply"),
                ring = ReadMesh(folder_ / "ring/surface.ply");
  const auto json = nlohmann::json::parse(ReadFileBytes(folder_ / "ring/result.json"))["trim"];
  const double distance = json["distance_mm"];
  for (const Vec3& p : ring.points) {
    const double radius = std::hypot(p.x(), p.y());
    EXPECT_GT(radius, 15 - distance);
    EXPECT_LT(radius, 40 + distance);
  }
  const double least = std::numbers::pi * (40 * 40 - 15 * 15);
  EXPECT_GT(Area(ring), least);
  EXPECT_LT(Area(ring), Area(whole));
  EXPECT_NEAR(json["kept_mm2"], Area(ring), 1e-4 * least);  // the file's points are floats
  EXPECT_NEAR(json["kept_mm2"].get<double>() + json["cut_mm2"].get<double>(), Area(whole),
              1e-3 * least);
  EXPECT_EQ(ReadHSpline(folder_ / "ring/surface.hspline.json").Net(0).vertices,
            ReadHSpline(folder_ / "whole/surface.hspline.json").Net(0).vertices);
  EXPECT_THAT(ReadFileBytes(folder_ / "ring/report.html"), HasSubstr("trimmed to within"));
}

TEST_F(FitTrim, ADistanceThatIsGivenIsTaken) {
  double before = 0;
  for (const double distance : {2.5, 5.0, 20.0}) {
    const std::string name = fmt::format("at_{}", distance);
    ASSERT_EQ(
        Fit(name, fmt::format("--set trim.type=cloud --set trim.distance_mm={}", distance)).code,
        0);
    const auto json = nlohmann::json::parse(ReadFileBytes(folder_ / name / "result.json"))["trim"];
    EXPECT_EQ(json["distance_mm"], distance);
    EXPECT_GT(json["kept_mm2"], before);
    before = json["kept_mm2"];
  }
}

TEST_F(FitTrim, ADistanceBelowThePointsSpacingIsRefusedBeforeTheFit) {
  const auto outcome = Fit("pieces", "--set trim.type=cloud --set trim.distance_mm=0.01");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("trim.distance_mm: 0.01 is less than what neighbouring"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "pieces/surface.ply"));
}

// A grid: its eighth neighbours are a diagonal away, and at its corners farther.
TEST(TrimOf, AutoFollowsTheEighthNeighboursDistance) {
  PointTable table;
  for (int i = 0; i < 60; ++i) {
    for (int j = 0; j < 60; ++j) {
      table.positions.emplace_back(i, j, 0);
      table.uv.emplace_back(i / 59.0, j / 59.0);
    }
  }
  const PointFit fit = FitPoints(table, PointFitOptions(), {});
  const auto trim = TrimOf(CloudTrim(), fit.fit, 1);
  ASSERT_TRUE(trim);
  EXPECT_GT(trim->distance_mm, 1.25 * std::sqrt(2) - 0.01);
  EXPECT_LT(trim->distance_mm, 1.25 * std::sqrt(5) + 0.01);  // beside a border
  EXPECT_FALSE(TrimOf(NoTrim(), fit.fit, 1));
}

TEST(TrimOf, AutoRefusesPointsThatCoincide) {
  FitResult fit{.surface =
                    HSplineSurface({.max_level = 0}, ControlNet{11, 11, {121, Vec3::Zero()}})};
  fit.uv.assign(50, Vec2(0.5, 0.5));
  EXPECT_THROW(TrimOf(CloudTrim(), fit, 1), InputError);
  fit.uv.resize(3);
  EXPECT_THROW(TrimOf(CloudTrim(), fit, 1), InputError);
}

TEST(CheckTrim, RefusesBeforeTheFitWhatAutoCannotTell) {
  std::vector<Vec3> points(50, Vec3(1, 2, 3));
  EXPECT_THROW(CheckTrim(CloudTrim(), points), InputError);
  EXPECT_NO_THROW(CheckTrim(NoTrim(), points));
  points = Ring(8);
  points.resize(8);
  EXPECT_THROW(CheckTrim(CloudTrim(), points), InputError);
  EXPECT_NO_THROW(CheckTrim(CloudTrim(), Ring(100)));
}

TEST(TrimText, SaysHowMuchIsLeftOut) {
  EXPECT_EQ(TrimText({.distance_mm = 1.25, .kept_mm2 = 3, .cut_mm2 = 1}),
            "trimmed to within 1.25 mm of a point: 25 % of the surface is left out");
  EXPECT_THAT(TrimText({.distance_mm = 1, .kept_mm2 = 3, .cut_mm2 = 0}), HasSubstr("nothing of"));
}

}  // namespace
}  // namespace semblance
