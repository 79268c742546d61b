// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/problem/parametrise.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "surfaces/base/error.h"
#include "tests/testing/scattered_data.h"

namespace semblance {
namespace {

using ::testing::HasSubstr;

std::vector<Vec3> FrankePoints(int count) {
  std::vector<Vec3> points;
  for (const FitPoint& p : testing::Scattered(testing::FrankePoint, count, 0, 1).points) {
    points.push_back(p.position);
  }
  return points;
}

// Of 400 points on a cylinder about `axis`, by angle and height.
Vec3 OnCylinder(int k, const Mat3& turn) {
  const double angle = 2 * std::numbers::pi * (k % 20) / 20.0;
  return turn * Vec3(30 * std::cos(angle), 30 * std::sin(angle), 5.0 * (k / 20)) + Vec3(1, 2, 3);
}

TEST(Parametrise, WithoutParametersThePlaneIsTaken) {
  const std::vector<Vec3> points = {{0, 0, 5}, {40, 0, 5}, {40, 10, 5}, {0, 10, 5}};
  const Parametrisation p = Parametrise(points);
  EXPECT_EQ(p.source, ParameterSource::kPlane);
  for (std::size_t k = 0; k < points.size(); ++k) {
    EXPECT_NEAR(p.uv[k].x(), points[k].x() / 40, 1e-12);  // the longer side is u
    EXPECT_NEAR(p.uv[k].y(), points[k].y() / 10, 1e-12);
  }
}

// Steep heights, which do not spread least upwards, over the plane that is asked for.
TEST(Parametrise, APlaneAcrossANormalHasItsHeights) {
  const std::vector<Vec3> points = FrankePoints(2000);
  const Parametrisation p = Parametrise(points, PlaneParameters{.normal = {0, 0, 2}});
  for (std::size_t k = 0; k < p.uv.size(); ++k) {
    EXPECT_NEAR(p.uv[k].x(), points[k].x(), 2e-3);  // the points nearly fill the square
    EXPECT_NEAR(p.uv[k].y(), points[k].y(), 2e-3);
  }
}

// However it stands: angles and heights come back, but for where the angle starts and its sense.
TEST(Parametrise, ACylinderFindsItsAxis) {
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, -2, 0.5).normalized()).matrix();
  std::vector<Vec3> points;
  for (int k = 0; k < 400; ++k) {
    points.push_back(OnCylinder(k, turn));
  }
  const Parametrisation p = Parametrise(points, CylinderParameters{});
  EXPECT_EQ(p.source, ParameterSource::kCylinder);
  const double up = p.uv[399].y() > p.uv[0].y() ? 1 : -1;
  for (int k = 0; k < 400; ++k) {
    EXPECT_NEAR(p.uv[k].y(), up > 0 ? (k / 20) / 19.0 : 1 - (k / 20) / 19.0, 1e-9);
    const double turned = std::abs(p.uv[k].x() - p.uv[k - k % 20].x()) * 20;
    EXPECT_NEAR(std::min(turned, 20 - turned), std::min(k % 20, 20 - k % 20), 1e-9);
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
  EXPECT_THAT(message(points, GivenParameters{}, {}), HasSubstr("needs each point's (u,v)"));
  EXPECT_THAT(message(points, GivenParameters{}, uv), HasSubstr("point 1 has (u,v) = (9, 0)"));
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
}

}  // namespace
}  // namespace semblance
