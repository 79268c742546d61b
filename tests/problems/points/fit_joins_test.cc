// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces that continue others: no gap, no crease, and their points still followed.
#include "problems/points/fit_joins.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <tuple>

#include "problems/points/join_places.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "tests/testing/joined_surfaces.h"
#include "tests/testing/scratch_file.h"

namespace semblance {
namespace {

using ::testing::AllOf;
using testing::ErrorAgainst;
using testing::FreeFit;
using ::testing::HasSubstr;
using testing::JoinFit;
using testing::NewSurface;
using testing::Opened;
using testing::OptionsOf;
using testing::PlaceBeside;
using testing::PlaceOf;
using testing::PlainStart;
using testing::RmsWhere;
using testing::Scattered;
using testing::WavyPoint;
using testing::WavyTarget;
using testing::WordsOf;

constexpr double kExtent = 1.4;  // of a unit square, mm
constexpr SurfaceEdge kEdges[] = {SurfaceEdge::kU0, SurfaceEdge::kU1, SurfaceEdge::kV0,
                                  SurfaceEdge::kV1};

Vec2 Itself(const Vec2& uv) { return uv; }
bool Everywhere(const Vec2&) { return true; }

HSplineSurface GivenSurface(const NewSurface& shape = {}) {
  return FreeFit(WavyTarget(Itself, 1500, 1e-3, 1), shape).surface;
}

// At the places where the edge is held: radians between a tangent across the edge and the given
// tangent plane.
double CreaseAtPlaces(const HSplineSurface& surface, const OpenedJoin& opened) {
  const EdgeSpans spans = SpansAlong(surface, opened.join.edge);
  const HeldEdge edge{.asked = spans, .spans = spans};
  double largest = 0;
  for (const ExactPoint& point :
       ExactPointsOf(std::span(&opened, 1), std::span(&edge, 1), surface.shape())) {
    const SurfaceFrame frame = surface.Frame(point.uv);
    const Vec3 across = RunsAlongV(opened.join.edge) ? frame.du : frame.dv;
    largest = std::max(largest, std::abs(across.normalized().dot(point.normal)));
  }
  return largest;
}

class EveryEdge : public ::testing::TestWithParam<std::tuple<SurfaceEdge, SurfaceEdge, bool>> {};

TEST_P(EveryEdge, JoinsEveryOther) {
  const auto [edge, its_edge, reversed] = GetParam();
  const SurfaceJoin join{.edge = edge, .its_edge = its_edge, .reversed = reversed};
  const OpenedJoin opened = Opened(GivenSurface(), join);
  const FitTarget target =
      WavyTarget([&](const Vec2& uv) { return PlaceBeside(join, uv); }, 1500, 1e-3, 2);
  const FitResult free = FreeFit(target, {});
  const JoinedFit joined = JoinFit(target, {opened}, {});
  ASSERT_EQ(joined.joins.size(), 1u);
  const JoinReport& report = joined.joins[0];
  EXPECT_TRUE(report.Holds()) << JoinLines(joined.joins)[0];
  EXPECT_LT(report.largest_gap_mm, 1e-9 * kExtent);
  EXPECT_LT(report.largest_angle_deg, 0.1);
  EXPECT_LT(CreaseAtPlaces(joined.fit.surface, opened), 1e-6);
  EXPECT_LT(joined.fit.point_rms_mm, 1.1 * free.point_rms_mm);
}

INSTANTIATE_TEST_SUITE_P(Joins, EveryEdge,
                         ::testing::Combine(::testing::ValuesIn(kEdges),
                                            ::testing::ValuesIn(kEdges), ::testing::Bool()));

const SurfaceJoin kRight{.edge = SurfaceEdge::kU0, .its_edge = SurfaceEdge::kU1};

FitTarget RightOf(int count, double noise = 1e-3) {
  return WavyTarget([](const Vec2& uv) { return PlaceBeside(kRight, uv); }, count, noise, 2);
}

// What differs from the free fit is beside the edge.
TEST(FitJoins, AwayFromTheEdgeNothingChanges) {
  const FitTarget target = RightOf(3000);
  const FitResult free = FreeFit(target, {});
  const JoinedFit joined = JoinFit(target, {Opened(GivenSurface(), kRight)}, {});
  const auto away = [](const Vec2& uv) { return uv.x() > 0.5; };
  EXPECT_NEAR(RmsWhere(target, joined.fit, away) / RmsWhere(target, free, away), 1, 0.01);
  EXPECT_LT(RmsWhere(target, joined.fit, Everywhere), 1.05 * RmsWhere(target, free, Everywhere));
}

// A surface that is given with detail of its own along the edge, whatever the new points ask for.
TEST(FitJoins, AFinerGivenEdgeIsFollowed) {
  HSplineSurface given = GivenSurface({.patches_v = 4, .plan = AdaptivePlan{.finest = 2}});
  // Beyond u = 1 by its knot, so it moves the edge.
  given.SetOffsets({{{2, 17, 7}, Vec3(0, 0, 0.02)}});
  const JoinedFit joined = JoinFit(RightOf(1500), {Opened(given, kRight)}, {});
  EXPECT_LT(joined.joins[0].largest_gap_mm, 1e-9 * kExtent);
  EXPECT_TRUE(joined.joins[0].Holds()) << JoinLines(joined.joins)[0];
}

// 3 and 4 patches: no curve of the one is one of the other, and the gap is made small instead.
TEST(FitJoins, OtherPatchesAreFollowedAsFarAsTheyCanBe) {
  for (const int its_patches : {2, 8, 3, 6}) {
    const HSplineSurface given = GivenSurface({.patches_v = its_patches});
    const JoinReport report = JoinFit(RightOf(1500), {Opened(given, kRight)},
                                      {.plan = AdaptivePlan{.tolerance_mm = 0.02, .finest = 5}})
                                  .joins[0];
    EXPECT_TRUE(report.Holds()) << its_patches << " patches: " << JoinLines({&report, 1})[0];
    if (its_patches % 3 != 0) {
      EXPECT_LT(report.largest_gap_mm, 1e-9 * kExtent) << its_patches;
    }
  }
}

TEST(FitJoins, PositionAloneLeavesTheAngleFree) {
  SurfaceJoin join = kRight;
  join.continuity = JoinContinuity::kPosition;
  // A roof: the new surface goes down from the edge.
  FitTarget target = RightOf(1500);
  for (FitPoint& p : target.points) {
    p.position.z() -= p.uv.x();
  }
  const JoinReport report = JoinFit(target, {Opened(GivenSurface(), join)}, {}).joins[0];
  EXPECT_LT(report.largest_gap_mm, 1e-9 * kExtent);
  EXPECT_GT(report.largest_angle_deg, 20);
  EXPECT_TRUE(report.Holds());
}

TEST(FitJoins, TheAutoPlanJoinsToo) {
  const NewSurface shape{.plan = AutoPlan{}};
  const FitTarget target = RightOf(4000);
  const FitResult free = FreeFit(target, shape);
  const JoinedFit joined = JoinFit(target, {Opened(GivenSurface(shape), kRight)}, shape);
  EXPECT_LT(joined.joins[0].largest_gap_mm, 1e-9 * kExtent);
  EXPECT_TRUE(joined.joins[0].Holds()) << JoinLines(joined.joins)[0];
  EXPECT_LT(joined.fit.point_rms_mm, 1.05 * free.point_rms_mm);
}

// Of a tube and its continuation.
TEST(FitJoins, ClosedEdgesAreJoined) {
  const auto tube = [](const Vec2& uv) -> Vec3 {
    const double p = 2 * std::numbers::pi * uv.x();
    return {std::cos(p) * (1 + 0.1 * uv.y() * uv.y()), std::sin(p), uv.y() + 0.1 * std::sin(2 * p)};
  };
  const FitOptions options = OptionsOf({});
  const HSplineShape shape{
      .patches_u = 6, .patches_v = 3, .max_level = 3, .closure = Closure::kPeriodicU};
  const FitTarget below = Scattered(tube, 2000, 1e-3, 1);
  const FitTarget above =
      Scattered([&](const Vec2& uv) { return tube(uv + Vec2(0, 1)); }, 2000, 1e-3, 2);
  const HSplineSurface given = Fit(PlainStart(shape), below, {}, options, {}).surface;
  const OpenedJoin opened = Opened(given, {.edge = SurfaceEdge::kV0, .its_edge = SurfaceEdge::kV1});
  const JoinedFit joined = FitJoined(PlainStart(shape), above, std::span(&opened, 1), options, {});
  EXPECT_LT(joined.joins[0].largest_gap_mm, 1e-8);
  EXPECT_TRUE(joined.joins[0].Holds()) << JoinLines(joined.joins)[0];
}

PlaceOf MovedBy(double x, double y) {
  return [=](const Vec2& uv) { return Vec2(uv + Vec2(x, y)); };
}

// Four squares around a corner, one after the other; the last is joined to two.
TEST(FitJoins, ACornerOfTwoJoinsCloses) {
  const auto target = [](double x, double y) {
    return WavyTarget(MovedBy(x, y), 1500, 1e-3, static_cast<std::uint64_t>(10 + 2 * x + y));
  };
  const SurfaceJoin above{.edge = SurfaceEdge::kV0, .its_edge = SurfaceEdge::kV1};
  const HSplineSurface first = FreeFit(target(0, 0), {}).surface;
  const HSplineSurface right = JoinFit(target(1, 0), {Opened(first, kRight)}, {}).fit.surface;
  const HSplineSurface upper = JoinFit(target(0, 1), {Opened(first, above)}, {}).fit.surface;
  const FitTarget last = target(1, 1);
  const JoinedFit joined = JoinFit(last, {Opened(upper, kRight), Opened(right, above)}, {});
  for (const JoinReport& report : joined.joins) {
    EXPECT_LT(report.largest_gap_mm, 1e-7 * kExtent);
    EXPECT_TRUE(report.Holds()) << JoinLines({&report, 1})[0];
  }
  EXPECT_LT(joined.fit.point_rms_mm, 1.1 * FreeFit(last, {}).point_rms_mm);
}

// Patches [i, i + 4] x [j, j + 4] of a spline of 12 x 12 over [0, 3]^2.
HSplineSurface PartOfOne(int i, int j) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 0};
  ControlNet net{shape.Columns(0), shape.Rows(0), {}};
  for (int row = 0; row < net.rows; ++row) {
    for (int column = 0; column < net.columns; ++column) {
      net.vertices.push_back(WavyPoint(Vec2(i + column - 1, j + row - 1) / 4));
    }
  }
  return HSplineSurface(shape, net);
}

// The four neighbours are of one surface, and so is what comes between them.
TEST(FitJoins, AHoleIsFilledFromFourSides) {
  const HSplineSurface truth = PartOfOne(4, 4);
  FitTarget target = Scattered([&](const Vec2& uv) { return truth.Point(uv); }, 1500, 1e-3, 3);
  const std::vector<OpenedJoin> joins = {
      Opened(PartOfOne(0, 4), {.edge = SurfaceEdge::kU0, .its_edge = SurfaceEdge::kU1}),
      Opened(PartOfOne(8, 4), {.edge = SurfaceEdge::kU1, .its_edge = SurfaceEdge::kU0}),
      Opened(PartOfOne(4, 0), {.edge = SurfaceEdge::kV0, .its_edge = SurfaceEdge::kV1}),
      Opened(PartOfOne(4, 8), {.edge = SurfaceEdge::kV1, .its_edge = SurfaceEdge::kV0})};
  const JoinedFit joined = JoinFit(target, joins, {});
  for (const JoinReport& report : joined.joins) {
    EXPECT_LT(report.largest_gap_mm, 1e-9 * kExtent);
    EXPECT_TRUE(report.Holds()) << JoinLines({&report, 1})[0];
  }
  EXPECT_LT(
      ErrorAgainst([&](const Vec2& uv) { return truth.Point(uv); }, joined.fit.surface, 50).rms,
      3e-4);
}

// A point of the table that is to be met stays one beside the joins.
TEST(FitJoins, ExactPointsAreMetBesideThem) {
  FitTarget target = RightOf(1500);
  const Vec2 uv(0.6, 0.4);
  target.exact = {{.uv = uv, .position = WavyPoint(PlaceBeside(kRight, uv)) + Vec3(0, 0, 0.05)}};
  const JoinedFit joined = JoinFit(target, {Opened(GivenSurface(), kRight)}, {});
  EXPECT_LT((joined.fit.surface.Point(uv) - target.exact[0].position).norm(), 1e-9);
  EXPECT_LT(joined.joins[0].largest_gap_mm, 1e-9 * kExtent);
  EXPECT_EQ(joined.fit.residual_mm.size(), 1500u);
}

TEST(FitJoins, ContradictionsAreRefused) {
  const HSplineSurface given = GivenSurface();
  const FitTarget target = RightOf(500);
  const auto refusal = [&](const std::vector<OpenedJoin>& joins, const NewSurface& shape) {
    return WordsOf<InputError>([&] { JoinFit(target, joins, shape); });
  };
  const OpenedJoin right = Opened(given, kRight);
  EXPECT_THAT(
      refusal({right, Opened(given, {.edge = SurfaceEdge::kV0, .its_edge = SurfaceEdge::kV1})}, {}),
      HasSubstr("at the corner of u0 and v0 the given surfaces are 1.4"));
  SurfaceJoin turned = kRight;
  turned.reversed = true;
  EXPECT_THAT(refusal({Opened(given, turned)}, {}), HasSubstr("write reversed: false"));
  SurfaceJoin far = kRight;
  far.its_edge = SurfaceEdge::kU0;
  EXPECT_THAT(refusal({Opened(given, far)}, {}),
              AllOf(HasSubstr("joins[0].its_edge: the points beside u0 are"),
                    HasSubstr("than to its u0; write its_edge: u1, reversed: false")));
  EXPECT_THAT(
      refusal({Opened(GivenSurface({.patches_v = 64, .plan = AdaptivePlan{.finest = 0}}), kRight)},
              {}),
      HasSubstr("as fine as 64 patches along it, the new edge u0 may have 32"));
  EXPECT_THAT(refusal({right}, {.patches_v = 600, .plan = AdaptivePlan{.finest = 0}}),
              HasSubstr("would be held at 603 places beside 0 exact points, more than 500"));
}

// One edge goes on in the plane of the other surface, the other leaves it.
TEST(FitJoins, ACreaseAtACornerIsRefused) {
  const auto flat = [](double slope) {
    FitTarget target = Scattered(
        [&](const Vec2& uv) -> Vec3 {
          return {uv.x(), uv.y(), slope * uv.x()};
        },
        200, 0, 1);
    return FreeFit(target, {.plan = AdaptivePlan{.finest = 0}}).surface;
  };
  const OpenedJoin level =
      Opened(flat(0), {.edge = SurfaceEdge::kU0, .its_edge = SurfaceEdge::kU0});
  const OpenedJoin steep =
      Opened(flat(1), {.edge = SurfaceEdge::kV0, .its_edge = SurfaceEdge::kV0});
  EXPECT_THAT(WordsOf<InputError>([&] {
                JoinFit(RightOf(200), {level, steep}, {});
              }),
              HasSubstr("one edge leaves the other's tangent plane by 45 degrees"));
}

TEST(FitJoins, TheNumberOfThreadsChangesNothing) {
  const FitTarget target = RightOf(2000);
  const std::vector<OpenedJoin> joins = {Opened(GivenSurface(), kRight)};
  for (const SchedulePlan& plan : {SchedulePlan(AutoPlan{}), NewSurface().plan}) {
    EXPECT_EQ(HSplineToJson(JoinFit(target, joins, {.plan = plan}, 1).fit.surface),
              HSplineToJson(JoinFit(target, joins, {.plan = plan}, 2).fit.surface));
  }
}

}  // namespace
}  // namespace semblance
