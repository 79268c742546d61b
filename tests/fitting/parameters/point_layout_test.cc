// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/point_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "fitting/parameters/parametrise.h"
#include "fitting/triangulation/even_points.h"
#include "fitting/triangulation/point_sheet.h"
#include "surfaces/base/error.h"
#include "tests/testing/bent_sheets.h"
#include "tests/testing/scattered_data.h"

namespace semblance {
namespace {

using testing::BentSheets;
using ::testing::HasSubstr;
using testing::ScatterOver;
using testing::Sheet;
using testing::SheetPoints;
using testing::SheetScatter;

// Of the affine map that brings true places around a point to those that were found: its area, at
// some points. One sign: one-to-one.
struct Turns {
  int forward = 0, backward = 0;
  double Minority() const {
    return std::min(forward, backward) / static_cast<double>(forward + backward);
  }
};

Turns TurnsOf(const Sheet& sheet, const SheetPoints& points, std::span<const Vec2> uv) {
  constexpr std::size_t kProbes = 200, kNeighbours = 20;
  Turns turns;
  for (std::size_t probe = 0; probe < kProbes; ++probe) {
    const std::size_t own = probe * points.at.size() / kProbes;
    const testing::Tangents tangents = testing::TangentsAt(sheet, points.at[own]);
    std::vector<std::pair<double, std::size_t>> nearest;
    for (std::size_t k = 0; k < points.at.size(); ++k) {
      const Vec2 way = points.at[k] - points.at[own];
      nearest.emplace_back((way.x() * tangents.u + way.y() * tangents.v).squaredNorm(), k);
    }
    std::nth_element(nearest.begin(), nearest.begin() + kNeighbours, nearest.end());
    Eigen::MatrixX3d from(kNeighbours, 3);
    Eigen::MatrixX2d to(kNeighbours, 2);
    for (std::size_t n = 0; n < kNeighbours; ++n) {
      const Vec2 way = points.at[nearest[n].second] - points.at[own];
      from.row(static_cast<Eigen::Index>(n)) << 1, way.x(), way.y();
      to.row(static_cast<Eigen::Index>(n)) = uv[nearest[n].second].transpose();
    }
    const Eigen::MatrixXd map = from.colPivHouseholderQr().solve(to);
    const double area = map(1, 0) * map(2, 1) - map(1, 1) * map(2, 0);
    ++(area > 0 ? turns.forward : turns.backward);
  }
  return turns;
}

void ExpectInUnitSquare(std::span<const Vec2> uv) {
  for (const Vec2& p : uv) {
    EXPECT_TRUE(p.allFinite() && p.minCoeff() >= 0 && p.maxCoeff() <= 1);
  }
}

TEST(PointLayout, SheetsThatFoldOverEveryPlaneAreLaidOutOneToOne) {
  for (const auto& [name, sheet] : BentSheets()) {
    for (const SheetScatter& how :
         {SheetScatter{}, SheetScatter{.noise = 0.1}, SheetScatter{.noise = 0.3},
          SheetScatter{.count = 6000, .noise = 1}, SheetScatter{.noise = 0.1, .unevenness = 20},
          SheetScatter{.noise = 0.1, .holes = 3}}) {
      const SheetPoints points = ScatterOver(sheet, how);
      const Parametrisation p = Parametrise(points.positions, MeshParameters{});
      EXPECT_EQ(p.source, ParameterSource::kMesh);
      EXPECT_THAT(p.how, HasSubstr("the points triangulated and laid out by lscm"));
      ExpectInUnitSquare(p.uv);
      EXPECT_LE(TurnsOf(sheet, points, p.uv).Minority(), how.noise == 1 ? 0.03 : 0)
          << name << ", noise " << how.noise;
    }
  }
}

TEST(PointLayout, IsTakenWhereEveryPlaneFolds) {
  for (const auto& [name, sheet] : BentSheets()) {
    const SheetPoints points = ScatterOver(sheet, {.count = 4000, .noise = 0.1});
    EXPECT_EQ(Parametrise(points.positions).uv, Parametrise(points.positions, MeshParameters{}).uv)
        << name;
  }
}

// They are off, and told of.
TEST(PointLayout, OutliersDoNotBecomePartOfTheSheet) {
  for (const auto& [name, sheet] : BentSheets()) {
    const PointLayout layout =
        LayOutPoints(ScatterOver(sheet, {.count = 5000, .noise = 0.1, .outliers = 0.01}).positions,
                     MeshMap::kLscm);
    EXPECT_EQ(layout.fault, "") << name;
    EXPECT_GT(layout.far_off, 5u) << name;
    EXPECT_LT(layout.far_off, 100u) << name;
  }
}

TEST(PointLayout, TheOrderOfThePointsDoesNotMatter) {
  const SheetPoints points = ScatterOver(testing::Ess, {.count = 4000, .noise = 0.2});
  std::vector<Vec3> turned = points.positions;
  std::reverse(turned.begin(), turned.end());
  std::vector<Vec2> at = LayOutPoints(turned, MeshMap::kLscm).at;
  std::reverse(at.begin(), at.end());
  EXPECT_EQ(at, LayOutPoints(points.positions, MeshMap::kLscm).at);
}

// Points of a lattice have ties between triangles.
TEST(PointLayout, ALatticeHasTheSameTrianglesEachTime) {
  EvenPoints lattice;
  for (int k = 0; k < 400; ++k) {
    lattice.positions.emplace_back(k % 20, k / 20, 0);
    lattice.spacings_mm.push_back(1);
  }
  const PointSheet once = SheetBetween(lattice);
  EXPECT_EQ(once.fault, "");
  EXPECT_NEAR(Area(once.mesh), 19 * 19, 1);
  std::vector<std::vector<char>> in_the_way;
  for (int k = 1; k < 5; ++k) {
    in_the_way.emplace_back(77777 * k);
    EXPECT_EQ(SheetBetween(lattice).mesh.triangles, once.mesh.triangles);
  }
}

// The triangles have no side of their own: most of the bowl looks down.
TEST(PointLayout, TheNormalLooksAlongAnAxisOnBalance) {
  const PointSheet sheet =
      SheetBetween(EvenlySpread(ScatterOver(testing::DeepBowl, {.count = 3000}).positions, 6));
  Vec3 sum = Vec3::Zero();
  for (const Triangle& t : sheet.mesh.triangles) {
    sum += TriangleAreaVector(sheet.mesh, t);
  }
  EXPECT_GT(sum.z(), 10 * std::abs(sum.x()));
}

Vec3 BallPoint(const Vec2& q) {
  const double z = 2 * q.x() - 1, turn = 2 * std::numbers::pi * q.y();
  return {std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z};
}

std::string FaultOf(const Sheet& sheet) {
  return LayOutPoints(ScatterOver(sheet, {.count = 4000, .noise = 0.1}).positions, MeshMap::kLscm)
      .fault;
}

TEST(PointLayout, WhatIsNoOpenSheetIsRefused) {
  EXPECT_THAT(FaultOf(BallPoint), HasSubstr("closed, or nearly so"));
  EXPECT_THAT(FaultOf(testing::RingPoint), HasSubstr("handles; if it is a ring"));
  EXPECT_THAT(FaultOf([](const Vec2& q) -> Vec3 {
                const double turn = 2 * std::numbers::pi * q.x();
                return {std::cos(turn), std::sin(turn), 3 * q.y()};
              }),
              HasSubstr("two long borders"));
  EXPECT_THAT(FaultOf([](const Vec2& q) -> Vec3 {
                return testing::OpenPipe(Vec2(2 * q.x() - std::floor(2 * q.x()), q.y())) +
                       Vec3(0, q.x() < 0.5 ? 0 : 40, 0);
              }),
              HasSubstr("it is in 2 pieces"));
  Random random(1);
  std::vector<Vec3> full;
  for (int k = 0; k < 3000; ++k) {
    full.push_back(random.InBox(0, 1));
  }
  EXPECT_THAT(LayOutPoints(full, MeshMap::kLscm).fault, HasSubstr("they fill space"));
  EXPECT_THROW(Parametrise(full, MeshParameters{}), InputError);
}

}  // namespace
}  // namespace semblance
