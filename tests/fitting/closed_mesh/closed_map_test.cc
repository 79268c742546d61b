// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/closed_mesh/closed_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "surfaces/base/error.h"
#include "tests/testing/closed_shapes.h"
#include "tests/testing/shapes.h"

namespace semblance {
namespace {

using ::testing::HasSubstr;

// Of the triangle's corners as seen from the centre; negative if it is turned over (Van Oosterom &
// Strackee 1983).
double SolidAngle(const std::vector<Vec3>& at, const Triangle& t) {
  const Vec3 &a = at[t[0]], &b = at[t[1]], &c = at[t[2]];
  return 2 * std::atan2(a.dot((b - a).cross(c - a)), 1 + a.dot(b) + b.dot(c) + c.dot(a));
}

// No triangle is turned, and together they go round once.
void ExpectOneToOne(const TriMesh& mesh, const ClosedLayout& layout) {
  ASSERT_EQ(layout.at.size(), mesh.points.size());
  double all = 0, least = 1;
  for (const Triangle& t : mesh.triangles) {
    const double own = SolidAngle(layout.at, t);
    all += own;
    least = std::min(least, own);
  }
  EXPECT_GT(least, 0);
  EXPECT_NEAR(all, 4 * std::numbers::pi, 1e-9);
  EXPECT_EQ(layout.folded, 0);
  EXPECT_NEAR(layout.axis.norm(), 1, 1e-12);
}

TEST(ClosedMap, EveryShapeIsLaidOutOneToOne) {
  for (const testing::ClosedShape& shape : testing::ClosedShapes()) {
    for (const double noise : {0.0, 3e-3}) {
      const TriMesh mesh = testing::MeshOf(shape, 3000, noise);
      const ClosedLayout layout = LayOutOnSphere(mesh);
      ExpectOneToOne(mesh, layout);
      EXPECT_EQ(layout.collapsed, 0) << shape.name;
    }
  }
}

// Needles at the poles of its grid too.
TEST(ClosedMap, ABallIsMappedToItself) {
  const TriMesh ball = testing::SphereMesh({0, 0, 0}, 1, 24);
  const ClosedLayout layout = LayOutOnSphere(ball);
  ExpectOneToOne(ball, layout);
  for (std::size_t k = 0; k < ball.points.size(); k += 7) {
    for (std::size_t n = 0; n < k; n += 11) {
      EXPECT_NEAR(layout.at[k].dot(layout.at[n]), ball.points[k].dot(ball.points[n]), 0.02);
    }
  }
}

TEST(ClosedMap, WhatIsLongOrFlatIsLaidOut) {
  for (const Vec3& axes : {Vec3(1, 1, 30), Vec3(1, 1, 0.02), Vec3(1, 8, 64)}) {
    TriMesh mesh = testing::SphereMesh({0, 0, 0}, 1, 24);
    for (Vec3& p : mesh.points) {
      p = p.cwiseProduct(axes);
    }
    ExpectOneToOne(mesh, LayOutOnSphere(mesh));
  }
}

TEST(ClosedMap, TrianglesWithoutAreaTurnNone) {
  TriMesh mesh = testing::MeshOf(testing::Bean(), 1000, 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 50) {
    mesh.points[mesh.triangles[t][1]] = mesh.points[mesh.triangles[t][0]];
  }
  ExpectOneToOne(mesh, LayOutOnSphere(mesh));
}

TEST(ClosedMap, AMeshThatLooksInwardsIsLaidOutTheOtherWayRound) {
  TriMesh mesh = testing::MeshOf(testing::Bean(), 500, 0);
  for (Triangle& t : mesh.triangles) {
    std::swap(t[1], t[2]);
  }
  ExpectOneToOne(mesh, LayOutOnSphere(mesh));
}

TEST(ClosedMap, TheOrderMakesNoDifference) {
  const TriMesh mesh = testing::MeshOf(testing::EllipsoidWithEars(), 800, 0),
                shuffled = testing::Shuffled(mesh);
  const ClosedLayout one = LayOutOnSphere(mesh), other = LayOutOnSphere(shuffled);
  EXPECT_EQ(one.axis, other.axis);
  for (std::size_t k = 0; k < mesh.points.size(); ++k) {
    const auto same = std::ranges::find(shuffled.points, mesh.points[k]);
    EXPECT_EQ(one.at[k], other.at[same - shuffled.points.begin()]);
  }
}

TEST(ClosedMap, ATetrahedronIsTheLeast) {
  const TriMesh mesh{.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                     .triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
  ExpectOneToOne(mesh, LayOutOnSphere(mesh));
}

TEST(ClosedMap, WhatIsNoBallIsRefusedWithWhatToDo) {
  const auto message = [](const TriMesh& mesh) -> std::string {
    try {
      LayOutOnSphere(mesh);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  };
  const TriMesh ball = testing::SphereMesh({0, 0, 50}, 10, 8);
  EXPECT_THAT(message(testing::Plate(10, 4)), HasSubstr("write closure: open"));
  EXPECT_THAT(message(testing::RingMesh(12)), HasSubstr("1 handles"));
  EXPECT_THAT(message(testing::RingMesh(12)), HasSubstr("parameters: torus"));
  EXPECT_THAT(message(testing::Joined(ball, testing::SphereMesh({0, 0, 0}, 10, 8))),
              HasSubstr("2 pieces"));
  TriMesh loose = ball, turned = ball,
          pillow{.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, .triangles = {{0, 1, 2}, {0, 2, 1}}};
  loose.points.emplace_back(1, 2, 3);
  EXPECT_THAT(message(loose), HasSubstr("1 of its"));
  std::swap(turned.triangles[5][0], turned.triangles[5][1]);
  EXPECT_THAT(message(turned), HasSubstr("3 with two that run against each other"));
  EXPECT_THAT(message(pillow), HasSubstr("encloses nothing"));
}

}  // namespace
}  // namespace semblance
