// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/relaxation/relaxation.h"
#include "fitting/relaxation/dowel_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "fitting/fit.h"
#include "fitting/problem/placement.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "tests/testing/splines.h"

namespace semblance::fitting {
namespace {

using testing::SmoothSurface;

HSplineShape Shape() { return {.patches_u = 4, .patches_v = 4, .max_level = 1}; }

// The subject: the template with a wavy face of up to 6 mm.
HSplineSurface Subject(const HSplineSurface& rest) {
  HSplineSurface subject = rest;
  ControlNet net = rest.Net(0);
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    const Vec3 out = Vec3(net.vertices[k].x(), net.vertices[k].y(), 0).normalized();
    net.vertices[k] += (3 + 3 * std::sin(1.3 * static_cast<double>(k))) * out;
  }
  subject.SetNet(0, net);
  return subject;
}

// A lattice of 8 x 8 dowels on the subject, with noise_mm along each axis; their (u,v) have errors
// of up to `error`.
FitTarget Dowels(const HSplineSurface& subject, double error, std::uint64_t random_seed = 3,
                 double noise_mm = 0) {
  Random random(random_seed);
  FitTarget target;
  for (int k = 0; k < 64; ++k) {
    const Vec2 uv((k % 8 + 0.5) / 8, (k / 8 + 0.5) / 8);
    const Vec2 off(random.Uniform(-error, error), random.Uniform(-error, error));
    target.points.push_back({.label = "site",
                             .position = subject.Point(uv) + random.InBox(-noise_mm, noise_mm),
                             .uv = (uv + off).cwiseMax(0).cwiseMin(1)});
  }
  return target;
}

// Root mean square distance to the surface of points of the subject between the dowels.
double HeldOutRms(const HSplineSurface& subject, const HSplineSurface& fitted) {
  const SurfaceProjector projector(fitted);
  double sum = 0;
  int count = 0;
  for (int j = 2; j < 15; ++j) {
    for (int i = 2; i < 15; ++i, ++count) {
      sum += std::pow(projector.Project(subject.Point(Vec2(i, j) / 16.0)).distance_mm, 2);
    }
  }
  return std::sqrt(sum / count);
}

// Every relaxation that moves points, with the given number of rounds.
std::vector<Relaxation> EveryRelaxation(int rounds) {
  const PointMoves moves{.rounds = rounds};
  return {FootpointRelaxation{moves}, AlternatingRelaxation{{moves}},
          TangentDistanceRelaxation{{moves}}, JointRelaxation{{moves}}};
}

std::string_view NameOf(const Relaxation& relaxation) {
  return std::visit([](const auto& chosen) { return chosen.kName; }, relaxation);
}

FitOptions Options(const Relaxation& relaxation) {
  FitOptions options;
  options.plan = ListedPlan{.schedule = {{0, 0.5}, {0, 0.5}, {0, 0.5}, {0, 1}}};
  options.terms = {PointTerm{}, SmoothnessTerm{.weight = 1e-3}, MembraneTerm{.weight = 1e-2}};
  options.relaxation = relaxation;
  return options;
}

// A faster version with relaxations of one round.
FitOptions ShortOptions(Relaxation relaxation) {
  if (auto* const sliding = std::get_if<TangentDistanceRelaxation>(&relaxation)) {
    sliding->tangent_rounds = 1;
  }
  FitOptions options = Options(relaxation);
  options.plan = ListedPlan{.schedule = {{0, 0.5}, {0, 1}}};
  return options;
}

std::vector<Vec2> Places(const FitTarget& target) {
  std::vector<Vec2> uv;
  for (const FitPoint& p : target.points) {
    uv.push_back(p.uv);
  }
  return uv;
}

// The mean over three sets of dowels with noise of 0.3 mm.
double MeanHeldOutRms(double error, const Relaxation& relaxation, int steps) {
  const HSplineSurface rest = SmoothSurface(Shape(), 2), subject = Subject(rest);
  FitOptions options = Options(relaxation);
  std::vector<ScheduleStep> schedule(steps - 1, {0, 0.5});
  schedule.push_back({0, 1});
  options.plan = ListedPlan{.schedule = schedule};
  double sum = 0;
  for (const std::uint64_t seed : {3, 4, 5}) {
    const FitTarget target = Dowels(subject, error, seed, 0.3);
    sum += HeldOutRms(subject, Fit(rest, target, {}, options, {}).surface);
  }
  return sum / 3;
}

TEST(Relaxation, UndoesAnErrorOfFivePercentOfTheDomain) {
  const double unperturbed = MeanHeldOutRms(0, NoRelaxation{}, 4);
  EXPECT_GT(MeanHeldOutRms(0.05, NoRelaxation{}, 4), 2.5 * unperturbed);
  EXPECT_GT(MeanHeldOutRms(0.05, NoRelaxation{}, 10), 2.5 * unperturbed);
  for (const Relaxation& relaxation : EveryRelaxation(5)) {
    SCOPED_TRACE(NameOf(relaxation));
    const int steps = std::holds_alternative<FootpointRelaxation>(relaxation) ? 10 : 4;
    EXPECT_LT(MeanHeldOutRms(0.05, relaxation, steps), 1.1 * unperturbed);
  }
}

TEST(Relaxation, LeavesNoCrease) {
  const HSplineSurface rest = SmoothSurface(Shape(), 2), subject = Subject(rest);
  const FitTarget exact = Dowels(subject, 0);
  const DowelMesh mesh(rest, Places(exact));
  const FitTarget target = Dowels(subject, 0.05);
  const auto crease_deg = [&](const FitTarget& t, const Relaxation& relaxation) {
    FitOptions options = Options(relaxation);
    options.plan = ListedPlan{.schedule = {{0, 0.5}, {0, 1}}};
    const FitResult result = Fit(rest, t, {}, options, {});
    return SharpestCrease_deg(result.surface, mesh, result.uv);
  };
  const double clean = crease_deg(exact, NoRelaxation{});
  EXPECT_GT(crease_deg(target, NoRelaxation{}), clean + 10);
  for (const Relaxation& relaxation : EveryRelaxation(5)) {
    SCOPED_TRACE(NameOf(relaxation));
    EXPECT_LT(crease_deg(target, relaxation), clean + 10);
  }
}

// The points' order differs from that of their (u,v), so some can only arrive by passing each
// other.
TEST(Relaxation, NeverTurnsATriangleOver) {
  const HSplineSurface rest = SmoothSurface(Shape(), 2), subject = Subject(rest);
  int prevented = 0;
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    for (std::size_t k = 0; k < 4; ++k) {
      FitTarget target = Dowels(subject, 0.15, seed);
      const DowelMesh mesh(rest, Places(target));
      ASSERT_EQ(mesh.Flips(Places(target)), 0);
      const RelaxationSummary summary =
          Relax(rest, rest, mesh, *EffectiveMoves(EveryRelaxation(10)[k]), target);
      EXPECT_EQ(mesh.Flips(Places(target)), 0);
      prevented += summary.flips_prevented;
      const FitResult result =
          Fit(rest, Dowels(subject, 0.15, seed), {}, ShortOptions(EveryRelaxation(1)[k]), {});
      EXPECT_EQ(mesh.Flips(result.uv), 0);
    }
  }
  EXPECT_GT(prevented, 0);
}

TEST(Relaxation, PenaltiesFall) {
  const HSplineSurface rest = SmoothSurface(Shape(), 2), subject = Subject(rest);
  FitTarget target = Dowels(subject, 0.05);
  const DowelMesh mesh(rest, Places(target));
  NetworkMoves moves{{.rounds = 5, .standard = 0.1}};
  moves.crease = 0.1;
  const RelaxationSummary some = Relax(subject, rest, mesh, moves, target);
  EXPECT_LT(some.after.distance, 0.5 * some.before.distance);
  EXPECT_GT(some.after.standard, 0);
  FitTarget held = Dowels(subject, 0.05);
  moves.standard = 1e6;
  const RelaxationSummary none = Relax(subject, rest, mesh, moves, held);
  EXPECT_LT(none.max_move_mm, 1e-2);
  EXPECT_GT(some.max_move_mm, 1);
}

// Only the first and the last round measure penalties, and the result has both.
TEST(Relaxation, AResultHasThePenaltiesBeforeAndAfter) {
  const HSplineSurface rest = SmoothSurface(Shape(), 2), subject = Subject(rest);
  const FitTarget target = Dowels(subject, 0.05);
  for (const Relaxation& relaxation : EveryRelaxation(2)) {
    const FitResult result = Fit(rest, target, {}, ShortOptions(relaxation), {});
    for (const LevelSummary& level : result.levels) {
      EXPECT_FALSE(level.terms.empty());
      EXPECT_GE(level.rank, 0);
      EXPECT_GT(level.rms_before_mm, 0);
      EXPECT_GT(level.rms_after_mm, 0);
    }
    for (const RelaxationSummary& moves : result.relaxations) {
      EXPECT_GT(moves.before.distance, 0);
      EXPECT_GT(moves.after.distance, 0);
    }
  }
}

TEST(Relaxation, APointOnTheSurfaceArrivesAtIt) {
  const HSplineSurface rest = SmoothSurface(Shape(), 2);
  const Vec2 truth(0.4, 0.6);
  FitTarget target{{{.label = "a", .position = rest.Point(truth), .uv = Vec2(0.45, 0.52)}}};
  const DowelMesh mesh(rest, Places(target));
  const FootpointRelaxation footpoint{{.rounds = 20, .damping = 0}};
  const RelaxationSummary summary = Relax(rest, rest, mesh, *EffectiveMoves(footpoint), target);
  EXPECT_LT((target.points[0].uv - truth).norm(), 1e-8);
  EXPECT_LT(summary.after.distance, 1e-12);
}

TEST(Relaxation, WithoutANetworkAPointCrossesTheSeamOfATube) {
  HSplineShape shape = Shape();
  shape.closure = Closure::kPeriodicU;
  const HSplineSurface rest = SmoothSurface(shape, 2);
  const Vec2 truth(0.01, 0.4);
  FitTarget target{{{.label = "a", .position = rest.Point(truth), .uv = Vec2(0.97, 0.45)}}};
  const DowelMesh mesh(rest, Places(target), DowelLinks::kNone);
  const FootpointRelaxation footpoint{{.rounds = 20, .damping = 0}};
  Relax(rest, rest, mesh, *EffectiveMoves(footpoint), target);
  EXPECT_LT((target.points[0].uv - truth).norm(), 1e-8);
}

TEST(Relaxation, IsEquivariantUnderRigidMotion) {
  const Similarity pose = {.scale = 1,
                           .rotation = Eigen::AngleAxisd(1.1, Vec3(1, 2, -1).normalized()).matrix(),
                           .translation = Vec3(30, -60, 9)};
  const HSplineSurface rest = SmoothSurface(Shape(), 2), subject = Subject(rest);
  const FitTarget target = Dowels(subject, 0.05);
  FitTarget moved = target;
  for (FitPoint& p : moved.points) {
    p.position = pose * p.position;
  }
  for (const Relaxation& relaxation : EveryRelaxation(1)) {
    SCOPED_TRACE(NameOf(relaxation));
    const FitOptions options = ShortOptions(relaxation);
    const FitResult a = Fit(rest, target, {}, options, {});
    const FitResult b = Fit(Transformed(rest, pose), moved, {}, options, {});
    for (std::size_t k = 0; k < a.uv.size(); ++k) {
      EXPECT_LT((a.uv[k] - b.uv[k]).norm(), 1e-6);
    }
    EXPECT_NEAR(a.point_rms_mm, b.point_rms_mm, 1e-6);
  }
}

TEST(Relaxation, OrderOfPointsAndDuplicatesDoNotMatter) {
  const HSplineSurface rest = SmoothSurface(Shape(), 2), subject = Subject(rest);
  FitTarget target = Dowels(subject, 0.05);
  target.points.push_back(target.points[5]);
  RunContext two;
  two.threads = 2;
  FitTarget reversed = target;
  std::reverse(reversed.points.begin(), reversed.points.end());
  for (const Relaxation& relaxation : EveryRelaxation(1)) {
    SCOPED_TRACE(NameOf(relaxation));
    const FitOptions options = ShortOptions(relaxation);
    const FitResult a = Fit(rest, target, {}, options, {});
    EXPECT_EQ(a.uv.back(), a.uv[5]);
    EXPECT_EQ(a.uv, Fit(rest, target, {}, options, two).uv);
    FitResult b = Fit(rest, reversed, {}, options, {});
    std::reverse(b.uv.begin(), b.uv.end());
    for (std::size_t k = 0; k < a.uv.size(); ++k) {
      EXPECT_LT((a.uv[k] - b.uv[k]).norm(), 1e-9);
    }
  }
}

// With full steps each round ends at its solution for points and penalties together.
TEST(Relaxation, EveryKindBringsThePointsNearer) {
  const HSplineSurface rest = SmoothSurface(Shape(), 2), subject = Subject(rest);
  const FitTarget target = Dowels(subject, 0.05);
  FitOptions options = Options(NoRelaxation{});
  options.plan = ListedPlan{.schedule = {{0, 1}}};
  const double without = Fit(rest, target, {}, options, {}).point_rms_mm;
  for (std::size_t k = 0; k < 4; ++k) {
    double before = without;
    for (const int rounds : {1, 2, 4}) {
      options.relaxation = EveryRelaxation(rounds)[k];
      SCOPED_TRACE(NameOf(options.relaxation));
      const double rms = Fit(rest, target, {}, options, {}).point_rms_mm;
      EXPECT_LT(rms, before);
      before = rms;
    }
  }
}

// A (u,v) that was placed by hand does not move.
TEST(Relaxation, AKeptPointStaysAndTheOthersMove) {
  const HSplineSurface rest = SmoothSurface(Shape(), 2), subject = Subject(rest);
  FitTarget target = Dowels(subject, 0.05);
  target.points[27].label = "n";
  for (Relaxation relaxation : EveryRelaxation(2)) {
    SCOPED_TRACE(NameOf(relaxation));
    std::visit(
        []<class R>(R& chosen) {
          if constexpr (std::is_base_of_v<PointMoves, R>) {
            chosen.kept = {"n"};
          }
        },
        relaxation);
    const FitResult fit = Fit(rest, target, {}, ShortOptions(relaxation), {});
    EXPECT_EQ(fit.uv[27], target.points[27].uv);
    EXPECT_NE(fit.uv[28], target.points[28].uv);
  }
}

// Without the barrier, points in the wrong order can pass each other.
TEST(Relaxation, WithoutABarrierPointsPassEachOther) {
  const HSplineSurface rest = SmoothSurface(Shape(), 2);
  FitTarget target = Dowels(rest, 0);
  std::swap(target.points[27].uv, target.points[28].uv);
  const FitTarget given = target;
  NetworkMoves moves =
      *EffectiveMoves(FootpointRelaxation{{.rounds = 20, .damping = 0, .max_move_mm = 50}});
  Relax(rest, rest, MakeNetwork(rest, target, moves), moves, target);
  EXPECT_GT((rest.Point(target.points[27].uv) - target.points[27].position).norm(), 1);
  target = given;
  moves.barrier = false;
  const DowelMesh loose = MakeNetwork(rest, target, moves);
  EXPECT_TRUE(loose.triangles().empty());
  Relax(rest, rest, loose, moves, target);
  EXPECT_LT((rest.Point(target.points[27].uv) - target.points[27].position).norm(), 1e-6);
}

TEST(Relaxation, UnusableRelaxationsAreRefused) {
  const HSplineSurface rest = SmoothSurface(Shape(), 2);
  const FitTarget target = Dowels(rest, 0);
  const auto message = [&](const FitOptions& options) -> std::string {
    try {
      Fit(rest, target, {}, options, {});
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  };
  FitOptions options = Options(TangentDistanceRelaxation{});
  options.terms = {PointTerm{.loss = RobustLoss::kTukey}};
  EXPECT_THAT(message(options), ::testing::HasSubstr("loss: none"));
  options.terms = {PriorTerm{}};
  EXPECT_THAT(message(options), ::testing::HasSubstr("'points'"));
  options = Options(JointRelaxation{});
  options.plan = AdaptivePlan{.finest = 1};
  EXPECT_THAT(message(options), ::testing::HasSubstr("joint goes level by level"));
}

TEST(Relaxation, IsReportedByStep) {
  const HSplineSurface rest = SmoothSurface(Shape(), 2), subject = Subject(rest);
  const FitTarget target = Dowels(subject, 0.05);
  const FitResult none = Fit(rest, target, {}, Options(NoRelaxation{}), {});
  EXPECT_TRUE(none.relaxations.empty());
  EXPECT_EQ(none.uv, Places(target));
  const FitResult result = Fit(rest, target, {}, Options(FootpointRelaxation{}), {});
  ASSERT_EQ(result.relaxations.size(), 4u);
  EXPECT_GT(result.relaxations[0].max_move_mm, 0);
  EXPECT_LT(result.relaxations[0].after.distance, result.relaxations[0].before.distance);
}

}  // namespace
}  // namespace semblance::fitting
