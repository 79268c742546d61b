// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/join_places.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/splines.h"

namespace semblance {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

OpenedJoin Along(SurfaceEdge edge, const HSplineShape& given, double its_slope = 0) {
  ControlNet net{given.Columns(0), given.Rows(0), {}};
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      const double x = (i - 1.0) / given.patches_u, y = (j - 1.0) / given.patches_v;
      net.vertices.emplace_back(x, y, its_slope * x * y);
    }
  }
  return {.join = {.surface = "given.json", .edge = edge, .its_edge = SurfaceEdge::kU1},
          .sha256 = "",
          .surface = HSplineSurface(given, net)};
}

EdgeSpans Uniform(int patches) {
  EdgeSpans spans;
  for (int k = 0; k < patches; ++k) {
    spans.push_back({0, k});
  }
  return spans;
}

std::vector<double> PlacesOf(const EdgeSpans& spans, const HSplineShape& shape) {
  const OpenedJoin join = Along(SurfaceEdge::kU0, {.patches_u = 1, .patches_v = 1, .max_level = 0});
  const HeldEdge edge{.asked = spans, .spans = spans};
  std::vector<double> places;
  for (const ExactPoint& point : ExactPointsOf(std::span(&join, 1), std::span(&edge, 1), shape)) {
    EXPECT_EQ(point.uv.x(), 0);
    EXPECT_EQ(point.tangents, HeldTangents::kAlongU);
    EXPECT_GT(point.normal.norm(), 0.99);
    places.push_back(point.uv.y());
  }
  EXPECT_EQ(static_cast<int>(places.size()), PlacesAlong(spans, /*closed=*/false));
  return places;
}

TEST(JoinPlaces, AreTheEndsOfSpansAndTwoMiddles) {
  EXPECT_THAT(PlacesOf(Uniform(1), {.patches_v = 1}), ElementsAre(0, 1 / 3.0, 2 / 3.0, 1));
  EXPECT_THAT(PlacesOf(Uniform(4), {.patches_v = 4}),
              ElementsAre(0, 0.125, 0.25, 0.5, 0.75, 0.875, 1));
  EXPECT_THAT(PlacesOf({{1, 0}, {1, 1}, {0, 1}}, {.patches_v = 2}),
              ElementsAre(0, 0.125, 0.25, 0.5, 0.75, 1));
}

// As many places as vertices, and their values determine these.
TEST(JoinPlaces, DetermineEveryCurveOfTheSpans) {
  for (int patches = 1; patches <= 40; ++patches) {
    const std::vector<double> places = PlacesOf(Uniform(patches), {.patches_v = patches});
    ASSERT_EQ(std::ssize(places), patches + 3);
    Eigen::MatrixXd values(patches + 3, patches + 3);
    for (int row = 0; row < patches + 3; ++row) {
      for (int k = 0; k < patches + 3; ++k) {
        values(row, k) = testing::CubicBSpline(places[row] * patches - k + 3);
      }
    }
    EXPECT_LT(values.inverse().norm() / std::sqrt(patches + 3.0), 60) << patches;
  }
}

TEST(JoinPlaces, SpansAreHalvedUntilTheyAreAsFineAsTheGivenOnes) {
  const HSplineShape ours{.patches_u = 4, .patches_v = 2, .max_level = 0};
  const NewShape shape{ours, /*finest=*/3};
  const auto held = [&](int its_patches) {
    return AsFineAsItsEdge(
        Uniform(2),
        Along(SurfaceEdge::kU0, {.patches_u = 1, .patches_v = its_patches, .max_level = 0}),
        "joins[0]", shape);
  };
  EXPECT_EQ(held(1), Uniform(2));
  EXPECT_EQ(held(2), Uniform(2));
  EXPECT_EQ(held(3), (EdgeSpans{{1, 0}, {1, 1}, {1, 2}, {1, 3}}));
  EXPECT_EQ(held(16).size(), 16u);
  EXPECT_THAT(
      testing::WordsOf<InputError>([&] { held(17); }),
      HasSubstr("joins[0]: the edge u1 of given.json is as fine as 17 patches along it, the "
                "new edge u0 may have 16 (patches_v: 2, finest level 3)"));
}

TEST(JoinPlaces, PartitionsAreMergedAndHalved) {
  const EdgeSpans left = {{1, 0}, {1, 1}, {0, 1}}, right = {{0, 0}, {1, 2}, {1, 3}};
  EXPECT_EQ(FinerOf(left, right, 2), (EdgeSpans{{1, 0}, {1, 1}, {1, 2}, {1, 3}}));
  EXPECT_EQ(FinerOf(left, left, 2), left);
  const HeldEdge edge{.asked = Uniform(2), .spans = left};
  const std::vector<double> at = {0.6};
  const HeldEdge halved{.asked = right, .spans = FinerOf(left, right, 2)};
  EXPECT_EQ(Halved(edge, at, /*levels=*/1, 2, /*finest=*/5), halved);
  EXPECT_EQ(Halved(edge, at, /*levels=*/9, 2, /*finest=*/1), halved);
  EXPECT_EQ(Reached({{0, 0}, {1, 2}, {1, 3}, {0, 2}, {0, 3}}, 4),
            (EdgeSpans{{1, 0}, {1, 1}, {1, 2}, {1, 3}, {1, 4}, {1, 5}, {0, 3}}));
  EXPECT_EQ(Halved(edge, {}, /*levels=*/1, 2, /*finest=*/5), edge);
}

// Each corner once, without a normal there, and one of those beside it.
TEST(JoinPlaces, ACornerOfTwoJoinsIsHeldOnce) {
  const HSplineShape given{.patches_u = 3, .patches_v = 3, .max_level = 0};
  const std::vector<OpenedJoin> joins = {Along(SurfaceEdge::kU0, given),
                                         Along(SurfaceEdge::kV1, given)};
  const std::vector<JoinCorner> corners = CornersOf(joins);
  ASSERT_EQ(corners.size(), 1u);
  EXPECT_EQ(corners[0].first_t, 1);
  EXPECT_EQ(corners[0].second_t, 0);
  const std::vector<HeldEdge> edges(2, {Uniform(4), Uniform(4)});
  int at_corner = 0, without_normal = 0;
  for (const ExactPoint& point :
       ExactPointsOf(joins, edges, {.patches_u = 4, .patches_v = 4, .max_level = 0})) {
    at_corner += point.uv == Vec2(0, 1) ? 1 : 0;
    without_normal += point.normal == Vec3::Zero() ? 1 : 0;
  }
  EXPECT_EQ(at_corner, 1);
  EXPECT_EQ(without_normal, 2);
}

// An edge that is a point has no tangent plane to continue.
TEST(JoinPlaces, APoleHasNoTangentPlane) {
  OpenedJoin join = Along(SurfaceEdge::kU0, {.patches_u = 2, .patches_v = 2, .max_level = 0});
  ControlNet net = join.surface.Net(0);
  for (Vec3& vertex : net.vertices) {
    vertex.y() = 0;
  }
  join.surface.SetNet(0, net);
  const std::vector<HeldEdge> edges = {{Uniform(2), Uniform(2)}};
  const auto points = [&] { return ExactPointsOf(std::span(&join, 1), edges, {.patches_v = 2}); };
  EXPECT_THAT(testing::WordsOf<InputError>(points), HasSubstr("has no tangent plane at t = 0"));
  join.join.continuity = JoinContinuity::kPosition;
  EXPECT_EQ(points().size(), 5u);
}

}  // namespace
}  // namespace semblance
