// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/parametrise.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/scattered_data.h"
#include "tests/testing/shapes.h"

namespace semblance::fitting {
namespace {

using ::testing::HasSubstr;

std::vector<Vec3> FrankePoints(int count) {
  std::vector<Vec3> points;
  for (const FitPoint& p : testing::Scattered(testing::FrankePoint, count, 0, 1).points) {
    points.push_back(p.position);
  }
  return points;
}

// Point k of 400 on a cylinder, 20 on each of 20 circles.
Vec3 OnCylinder(int k, const Mat3& turn) {
  const double angle = 2 * std::numbers::pi * (k % 20) / 20.0;
  return turn * Vec3(30 * std::cos(angle), 30 * std::sin(angle), 5.0 * (k / 20)) + Vec3(1, 2, 3);
}

TEST(Parametrise, AutoTakesThePlane) {
  const std::vector<Vec3> points = {{0, 0, 5}, {40, 0, 5}, {40, 10, 5}, {0, 10, 5}};
  const Parametrisation p = Parametrise(points);
  EXPECT_EQ(p.source, ParameterSource::kPlane);
  for (std::size_t k = 0; k < points.size(); ++k) {
    EXPECT_NEAR(p.uv[k].x(), points[k].x() / 40, 1e-12);  // the longer side is u
    EXPECT_NEAR(p.uv[k].y(), points[k].y() / 10, 1e-12);
  }
}

// Steep heights, which do not spread least upwards, over a given plane.
// Gross errors on one side tilt the plane of least squares; most heights still agree over x and y.
// Of few points hardly any are neighbours.
TEST(Parametrise, HeightsOverXyStayThatWithOutliersOrFewPoints) {
  for (const int count : {30, 5000}) {
    Random random(5);
    std::vector<Vec3> positions;
    for (int k = 0; k < count; ++k) {
      const double x = random.Uniform(), y = random.Uniform();
      const double off = random.Uniform() < 0.2 ? random.Uniform(0.1, 1) : 0;
      positions.emplace_back(x, y, 0.3 * std::sin(6 * x) * std::cos(5 * y) + off);
    }
    EXPECT_TRUE(Parametrise(positions, AutoParameters{}).is_graph) << count;
  }
}

TEST(Parametrise, APlaneAcrossANormalHasItsHeights) {
  const std::vector<Vec3> points = FrankePoints(2000);
  const Parametrisation p = Parametrise(points, PlaneParameters{.normal = {0, 0, 2}});
  for (std::size_t k = 0; k < p.uv.size(); ++k) {
    EXPECT_NEAR(p.uv[k].x(), points[k].x(), 2e-3);  // the points nearly fill the square
    EXPECT_NEAR(p.uv[k].y(), points[k].y(), 2e-3);
  }
}

Scan GoingRound(std::span<const Vec3> points) {
  return {.positions = points, .closure = Closure::kPeriodicU};
}

// Angles and heights come back in any pose, but for the start and the sense of the angle.
TEST(Parametrise, ACylinderFindsItsAxis) {
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, -2, 0.5).normalized()).matrix();
  std::vector<Vec3> points;
  for (int k = 0; k < 400; ++k) {
    points.push_back(OnCylinder(k, turn));
  }
  const Parametrisation p = Parametrise(GoingRound(points), CylinderParameters{});
  EXPECT_EQ(p.source, ParameterSource::kCylinder);
  const double up = p.uv[399].y() > p.uv[0].y() ? 1 : -1;
  for (int k = 0; k < 400; ++k) {
    EXPECT_NEAR(p.uv[k].y(), up > 0 ? (k / 20) / 19.0 : 1 - (k / 20) / 19.0, 1e-9);
    const double turned = std::abs(p.uv[k].x() - p.uv[k - k % 20].x()) * 20;
    EXPECT_NEAR(std::min(turned, 20 - turned), std::min(k % 20, 20 - k % 20), 1e-9);
  }
}

// `count` points on a sphere.
std::vector<Vec3> OnSphere(int count) {
  Random random(3);
  std::vector<Vec3> points;
  for (int k = 0; k < count; ++k) {
    points.push_back(40 * Vec3(random.Normal(), random.Normal(), random.Normal()).normalized());
  }
  return points;
}

// `count` points on a tube whose ends are closed by flat lids.
std::vector<Vec3> Tin(int count) {
  Random random(3);
  std::vector<Vec3> points;
  for (int k = 0; k < count; ++k) {
    const double turn = 2 * std::numbers::pi * random.Uniform(), place = random.Uniform();
    const double r = k % 3 == 0 ? 30 * std::sqrt(place) : 30,
                 z = k % 3 == 0 ? 60.0 * (k % 2) : 60 * place;
    points.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
  }
  return points;
}

std::string WordsOf(const Scan& scan, const Parameters& parameters) {
  try {
    Parametrise(scan, parameters);
  } catch (const InputError& e) {
    return e.what();
  }
  return "no error";
}

// Steep heights spread most upwards: they fold over the plane of least squares, but not over the
// plane across z.
TEST(Parametrise, AFoldedPlaneIsLeftForAnAxis) {
  std::vector<Vec3> points = FrankePoints(4000);
  for (Vec3& p : points) {
    p.z() *= 5;
  }
  const Parametrisation p = Parametrise(points);
  EXPECT_EQ(p.how, "the plane across z");
  EXPECT_LT(p.faults.Sum(), 0.003);
  for (std::size_t k = 0; k < p.uv.size(); ++k) {
    EXPECT_NEAR(p.uv[k].x(), points[k].x(), 2e-3);
  }
}

TEST(Parametrise, FoldsOverEveryPlaneAreRefusedUnlessAccepted) {
  const std::vector<Vec3> sphere = OnSphere(3000);
  for (const Parameters& parameters : {Parameters(AutoParameters{}), Parameters(PlaneParameters{}),
                                       Parameters(PlaneParameters{.normal = {1, 2, 3}})}) {
    const std::string words = WordsOf({.positions = sphere}, parameters);
    EXPECT_THAT(words, HasSubstr("fold over"));
    EXPECT_THAT(words, HasSubstr("parameters: mesh"));
  }
  const Parametrisation accepted = Parametrise(sphere, PlaneParameters{.folds = FoldRule::kAccept});
  EXPECT_GT(accepted.faults.folded, 0.3);
}

// The lids of a tin collapse around its own axis, but not around another.
TEST(Parametrise, ACylinderOnWhichLidsCollapseIsRefusedOrLeft) {
  const std::vector<Vec3> tin = Tin(20000);
  const CylinderParameters upright{.axis = {0, 0, 1}};
  EXPECT_THAT(WordsOf(GoingRound(tin), upright), HasSubstr("close at its ends"));
  const Parametrisation other = Parametrise(GoingRound(tin));
  EXPECT_EQ(other.source, ParameterSource::kCylinder);
  EXPECT_LT(other.faults.Sum(), 0.02);
  const CylinderParameters accepted{.axis = {0, 0, 1}, .folds = FoldRule::kAccept};
  EXPECT_GT(Parametrise(GoingRound(tin), accepted).faults.collapsed, 0.1);
}

TEST(Parametrise, AutoTakesTheCylinderForASurfaceThatGoesRound) {
  std::vector<Vec3> points;
  for (int k = 0; k < 400; ++k) {
    points.push_back(OnCylinder(k, Mat3::Identity()));
  }
  const Parametrisation p = Parametrise(Scan{.positions = points, .closure = Closure::kPeriodicU});
  EXPECT_EQ(p.source, ParameterSource::kCylinder);
}

// Its ends are tips, as those of a ball are, but they are open.
TEST(Parametrise, ATubeThatIsCutAslantStaysACylinder) {
  std::vector<Vec3> points;
  for (int k = 0; k < 400; ++k) {
    points.push_back(OnCylinder(k, Mat3::Identity()));
    points.back().z() += 0.7 * points.back().x();
  }
  const Parametrisation p = Parametrise(Scan{.positions = points, .closure = Closure::kPeriodicU});
  EXPECT_EQ(p.source, ParameterSource::kCylinder);
}

// Points of a sheet that is bent round an axis by some degrees, with waves of 5 % of the radius.
std::vector<Vec3> BentSheet(double degrees, const Mat3& turn) {
  Random random(4);
  std::vector<Vec3> points;
  for (int k = 0; k < 3000; ++k) {
    const double angle = degrees * std::numbers::pi / 180 * random.Uniform(),
                 z = 80 * random.Uniform(), r = 30 + 1.5 * std::sin(5 * angle) * std::cos(z / 9);
    points.emplace_back(turn * Vec3(r * std::cos(angle), r * std::sin(angle), z) +
                        Vec3(500, -20, 7));
  }
  return points;
}

// Lengths round the axis and along it come back, but for the start and the senses.
TEST(Parametrise, ASheetThatIsBentRoundAnAxisIsRolledOut) {
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, -2, 0.5).normalized()).matrix();
  for (const double degrees : {220.0, 250.0, 330.0}) {
    const std::vector<Vec3> points = BentSheet(degrees, turn);
    for (const Parameters& parameters :
         {Parameters(AutoParameters{}), Parameters(CylinderParameters{})}) {
      const Parametrisation p = Parametrise(points, parameters);
      EXPECT_EQ(p.source, ParameterSource::kCylinder) << degrees;
      EXPECT_LT(p.faults.Sum(), 0.002);
      const double round_mm = 30 * degrees * std::numbers::pi / 180;
      EXPECT_NEAR(p.lengths_mm.maxCoeff(), std::max(round_mm, 80.0), 0.05 * round_mm);
      EXPECT_NEAR(p.lengths_mm.minCoeff(), std::min(round_mm, 80.0), 0.05 * round_mm);
    }
  }
}

TEST(Parametrise, ATubeThatClosesHasNoOpenCylinder) {
  const std::vector<Vec3> tube = BentSheet(360, Mat3::Identity());
  std::vector<Vec3> columns;  // 12 of them, 30 degrees apart
  for (int k = 0; k < 600; ++k) {
    const double angle = k % 12 * std::numbers::pi / 6;
    columns.emplace_back(30 * std::cos(angle), 30 * std::sin(angle), k / 12);
  }
  for (const std::vector<Vec3>& points : {tube, columns}) {
    EXPECT_THAT(WordsOf({.positions = points}, CylinderParameters{}), HasSubstr("periodic_u"));
  }
  EXPECT_THAT(WordsOf({.positions = tube}, AutoParameters{}), HasSubstr("fold over"));
}

// A ball of which a slice is missing, and a filled tube of which one is missing.
TEST(Parametrise, WhatClosesAtItsEndsOrIsFilledIsNoBentSheet) {
  std::vector<Vec3> ball = OnSphere(4000), filled;
  std::erase_if(ball, [](const Vec3& p) { return std::abs(std::atan2(p.y(), p.x())) < 0.4; });
  Random random(8);
  for (const Vec3& p : BentSheet(300, Mat3::Identity())) {
    const Vec2 across = std::sqrt(random.Uniform()) * (p.head<2>() - Vec2(500, -20));
    filled.emplace_back(across.x(), across.y(), p.z());
  }
  EXPECT_THAT(WordsOf({.positions = ball}, AutoParameters{}), HasSubstr("fold over"));
  EXPECT_NE(Parametrise(filled).source, ParameterSource::kCylinder);  // the fit refuses it later
}

TEST(Parametrise, ABallIsNoTube) {
  const std::vector<Vec3> points = OnSphere(3000);
  const Scan ball{.positions = points, .closure = Closure::kPeriodicU};
  for (const Parameters& parameters :
       {Parameters(AutoParameters{}), Parameters(CylinderParameters{})}) {
    EXPECT_THAT(WordsOf(ball, parameters), HasSubstr("close at an end of the cylinder"));
  }
}

TEST(Parametrise, AutoTakesThePlaneForAMeshThatDoesNotFold) {
  const TriMesh mesh = testing::GridMesh(
      [](const Vec2& uv) { return Vec3(90 * uv.x(), 60 * uv.y(), 9 * std::sin(3 * uv.x())); }, 40);
  const Scan scan{.positions = mesh.points, .triangles = mesh.triangles};
  EXPECT_EQ(Parametrise(scan).source, ParameterSource::kPlane);
  EXPECT_EQ(Parametrise(scan, MeshParameters{}).source, ParameterSource::kMesh);
}

TEST(Parametrise, AClosedMeshIsRefused) {
  const TriMesh ring = testing::RingMesh(20);
  EXPECT_THAT(
      WordsOf({.positions = ring.points, .triangles = ring.triangles}, AutoParameters{}),
      HasSubstr("it is closed and has no border; cut it open, or give the columns u and v"));
}

// Two thirds of a sphere, as a scan, folds over every plane, and its triangles are laid out. The
// normal of the surface faces as theirs, inwards or outwards.
TEST(Parametrise, TrianglesThatFoldAreLaidOut) {
  const auto bowl = [](const Vec2& uv) -> Vec3 {
    const Vec2 q = 2 * uv - Vec2(1, 1);
    const double t = 2 * q.cwiseAbs().maxCoeff(), p = std::atan2(q.y(), q.x());
    return 50 * Vec3(std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t));
  };
  TriMesh mesh = testing::GridMesh(bowl, 40);
  for (const bool inward : {false, true}) {
    for (Triangle& t : mesh.triangles) {
      if (inward) {
        std::swap(t[1], t[2]);
      }
    }
    const Parametrisation p =
        Parametrise(Scan{.positions = mesh.points, .triangles = mesh.triangles});
    EXPECT_EQ(p.source, ParameterSource::kMesh);
    const MapFaults faults = FaultsOfTriangles({mesh.points, p.uv}, mesh.triangles);
    EXPECT_EQ(faults.folded, 0);
    EXPECT_FALSE(faults.mirrored);
  }
}

// Heights stay on the plane, and the surface faces as the triangles.
TEST(Parametrise, APlaneFacesAsTheTriangles) {
  TriMesh mesh = testing::GridMesh(
      [](const Vec2& uv) { return Vec3(9 * uv.x(), 4 * uv.y(), std::sin(2 * uv.x())); }, 20);
  for (const bool inward : {false, true}) {
    for (Triangle& t : mesh.triangles) {
      if (inward) {
        std::swap(t[1], t[2]);
      }
    }
    const Parametrisation p =
        Parametrise(Scan{.positions = mesh.points, .triangles = mesh.triangles});
    EXPECT_EQ(p.source, ParameterSource::kPlane);
    EXPECT_FALSE(FaultsOfTriangles({mesh.points, p.uv}, mesh.triangles).mirrored);
  }
}

TEST(Parametrise, TheRangeOfGivenParametersIsMapped) {
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Vec2> uv = {{0, 0}, {9, 0}, {4.5, 9}};
  const GivenParameters given{.u_range = {0, 9}, .v_range = {0, 9}};
  const Parametrisation p = Parametrise(points, given, uv);
  EXPECT_EQ(p.source, ParameterSource::kGiven);
  EXPECT_EQ(p.uv[2], Vec2(0.5, 1));
}

TEST(Parametrise, WrongInputIsNamed) {
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Vec2> uv = {{0, 0}, {9, 0}, {4.5, 9}};
  const auto message = [](std::span<const Vec3> at, const Parameters& parameters,
                          std::span<const Vec2> given) -> std::string {
    try {
      Parametrise(at, parameters, given);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_THAT(message({}, AutoParameters{}, {}), HasSubstr("there is no point"));
  EXPECT_THAT(message(points, GivenParameters{}, {}), HasSubstr("needs the (u,v) of each point"));
  EXPECT_THAT(
      message(points, GivenParameters{}, uv),
      HasSubstr("point 2 has (u,v) = (9, 0), outside [0, 1] x [0, 1]; to take all points, write "
                "parameters: {type: given, u_range: [0, 9], v_range: [0, 9]}"));
  const std::vector<Vec2> lost = {{0, 0}, {9, 0}, {4.5, kNaN}};
  EXPECT_THAT(message(points, GivenParameters{.u_range = {0, 9}}, lost),
              HasSubstr("point 3 has (u,v) = (4.5, nan), which is not finite; give numbers"));
  EXPECT_THAT(message(points, AutoParameters{}, std::span(uv).first(2)),
              HasSubstr("2 pairs (u,v) for 3 points"));
  EXPECT_THAT(message(points, GivenParameters{.u_range = {1, 0}}, uv),
              HasSubstr("range [1, 0] is empty"));
  const std::vector<Vec3> line = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  EXPECT_THAT(message(line, PlaneParameters{}, {}), HasSubstr("lie on a line"));
  std::vector<Vec3> slanted;  // whose moments are of full rank but for rounding
  for (int k = 0; k < 100; ++k) {
    slanted.push_back(k * Vec3(1, 2, 3));
  }
  EXPECT_THAT(message(slanted, AutoParameters{}, {}), HasSubstr("lie on a line"));
  EXPECT_THAT(message(points, MeshParameters{}, {}), HasSubstr("needs triangles"));
  const std::vector<Triangle> triangles = {{0, 1, 3}};
  EXPECT_THAT(WordsOf({.positions = points, .triangles = triangles}, MeshParameters{}),
              HasSubstr("has the corner 3"));
}

}  // namespace
}  // namespace semblance::fitting
