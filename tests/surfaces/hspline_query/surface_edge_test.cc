// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/surface_edge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "tests/testing/splines.h"

namespace semblance {
namespace {

using ::testing::ElementsAre;
using testing::RandomSurface;
using testing::SmoothSurface;

constexpr SurfaceEdge kEdges[] = {SurfaceEdge::kU0, SurfaceEdge::kU1, SurfaceEdge::kV0,
                                  SurfaceEdge::kV1};

// Columns [first, first + count) of a net, as a surface of its own.
HSplineSurface Columns(const HSplineSurface& whole, int first, int count) {
  const ControlNet net = whole.Net(0);
  ControlNet part{count, net.rows, {}};
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < count; ++i) {
      part.vertices.push_back(net.At(first + i, j));
    }
  }
  return HSplineSurface(
      {.patches_u = count - 3, .patches_v = whole.shape().patches_v, .max_level = 0}, part);
}

HSplineSurface TurnedAlongV(const HSplineSurface& surface) {
  ControlNet net = surface.Net(0);
  for (int j = 0; 2 * j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      std::swap(net.At(i, j), net.At(i, net.rows - 1 - j));
    }
  }
  return HSplineSurface(surface.shape(), net);
}

struct Worst {
  double gap_mm = 0, angle_deg = 0;
};
Worst WorstOf(const std::vector<EdgeMeeting>& meetings) {
  Worst worst;
  for (const EdgeMeeting& meeting : meetings) {
    worst.gap_mm = std::max(worst.gap_mm, meeting.gap_mm);
    worst.angle_deg = std::max(worst.angle_deg, meeting.angle_deg);
  }
  return worst;
}

TEST(SurfaceEdge, SpansCoverTheEdgeOnce) {
  for (const Closure closure : {Closure::kOpen, Closure::kPeriodicU}) {
    const HSplineSurface surface = RandomSurface(
        {.patches_u = 5, .patches_v = 4, .max_level = 3, .closure = closure}, /*random_seed=*/3);
    for (const SurfaceEdge edge : kEdges) {
      if (!HasEdge(surface.shape(), edge)) {
        continue;
      }
      const int patches = PatchesAlong(surface.shape(), edge);
      double reached = 0;
      int finest = 0;
      for (const EdgeSpan& span : SpansAlong(surface, edge)) {
        EXPECT_EQ(span.Begin(patches), reached);
        reached = span.End(patches);
        finest = std::max(finest, span.level);
      }
      EXPECT_EQ(reached, 1);
      EXPECT_GT(finest, 0);
    }
  }
}

TEST(SurfaceEdge, AnEditedVertexSplitsThePatchesThatItReaches) {
  HSplineSurface surface =
      SmoothSurface({.patches_u = 4, .patches_v = 4, .max_level = 1}, /*random_seed=*/1);
  surface.SetOffsets({{{1, 0, 5}, Vec3(0, 0, 1)}});  // on v = 1/2; moves v in (1/4, 3/4) near u = 0
  EXPECT_THAT(SpansAlong(surface, SurfaceEdge::kU0),
              ElementsAre(EdgeSpan{0, 0}, EdgeSpan{1, 2}, EdgeSpan{1, 3}, EdgeSpan{1, 4},
                          EdgeSpan{1, 5}, EdgeSpan{0, 3}));
  EXPECT_EQ(SpansAlong(surface, SurfaceEdge::kU1).size(), 4u);
}

TEST(SurfaceEdge, TwoPartsOfOneSurfaceMeet) {
  const HSplineSurface whole =
      SmoothSurface({.patches_u = 8, .patches_v = 5, .max_level = 0}, /*random_seed=*/2);
  const HSplineSurface left = Columns(whole, 0, 7), right = Columns(whole, 4, 7);
  const Worst as_it_is =
      WorstOf(MeetingsAlong({right, SurfaceEdge::kU0}, {left, SurfaceEdge::kU1}, {}));
  EXPECT_LT(as_it_is.gap_mm, 1e-12);
  EXPECT_LT(as_it_is.angle_deg, 1e-10);
  // Turned over, so that its normal looks the other way too.
  const HSplineSurface turned = TurnedAlongV(right);
  const Worst reversed = WorstOf(
      MeetingsAlong({turned, SurfaceEdge::kU0}, {left, SurfaceEdge::kU1}, {.reversed = true}));
  EXPECT_LT(reversed.gap_mm, 1e-12);
  EXPECT_LT(reversed.angle_deg, 1e-10);
  EXPECT_GT(WorstOf(MeetingsAlong({turned, SurfaceEdge::kU0}, {left, SurfaceEdge::kU1}, {})).gap_mm,
            1);
}

// A square, and one that leaves it at an angle.
TEST(SurfaceEdge, TheAngleIsThatOfTheTangentPlanes) {
  const auto square = [](double lift_deg) {
    const HSplineShape shape{.patches_u = 2, .patches_v = 3, .max_level = 0};
    const double angle = lift_deg * std::numbers::pi / 180;
    ControlNet net{shape.Columns(0), shape.Rows(0), {}};
    for (int j = 0; j < net.rows; ++j) {
      for (int i = 0; i < net.columns; ++i) {
        const double u = (i - 1) / 2.0, v = (j - 1) / 3.0;
        net.vertices.emplace_back(u * std::cos(angle), v, u * std::sin(angle));
      }
    }
    return HSplineSurface(shape, net);
  };
  for (const double lift_deg : {0.0, 1e-4, 30.0, 90.0, 150.0, 180.0}) {
    const Worst worst = WorstOf(
        MeetingsAlong({square(lift_deg), SurfaceEdge::kU0}, {square(0), SurfaceEdge::kU0}, {}));
    EXPECT_LT(worst.gap_mm, 1e-15);
    EXPECT_NEAR(worst.angle_deg, std::min(lift_deg, 180 - lift_deg), 1e-9) << lift_deg;
  }
}

TEST(SurfaceEdge, WhatGoesRoundHasNoEdgeAcross) {
  const HSplineShape tube{.closure = Closure::kPeriodicU};
  EXPECT_FALSE(HasEdge(tube, SurfaceEdge::kU0));
  EXPECT_TRUE(HasEdge(tube, SurfaceEdge::kV1));
  EXPECT_TRUE(IsClosedAlong(tube, SurfaceEdge::kV1));
  const HSplineShape torus{.closure = Closure::kPeriodicUv};
  for (const SurfaceEdge edge : kEdges) {
    EXPECT_FALSE(HasEdge(torus, edge));
    EXPECT_TRUE(IsClosedAlong(torus, edge));
  }
  EXPECT_TRUE(HasEdge({}, SurfaceEdge::kU1));
  EXPECT_FALSE(IsClosedAlong({}, SurfaceEdge::kV0));
}

}  // namespace
}  // namespace semblance
