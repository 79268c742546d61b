// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/relaxation/foot_moves.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <vector>

#include "fitting/fit.h"
#include "fitting/problem/start_surface.h"
#include "surfaces/base/error.h"
#include "tests/testing/scattered_data.h"
#include "tests/testing/shapes.h"

namespace semblance::fitting {
namespace {

using testing::FrankePoint;
using testing::HeadPoint;

struct Columns {
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;

  ScatteredPoints View() const { return {positions, uv, {}}; }
};

HSplineShape Shape(Closure closure) {
  return {.patches_u = 8, .patches_v = 8, .max_level = 0, .closure = closure};
}

// Points with errors of (u,v) of the given standard deviation.
template <class Surface>
Columns Disturbed(const Surface& surface, Closure closure, int count, double noise, double error) {
  const HSplineShape shape = Shape(closure);
  Random random(11);
  Columns columns;
  for (const FitPoint& p : testing::Scattered(surface, count, noise, 5).points) {
    const double u = p.uv.x() + error * random.Normal(), v = p.uv.y() + error * random.Normal();
    columns.positions.push_back(p.position);
    columns.uv.emplace_back(IntoUnit(u, shape.ClosedU()), std::clamp(v, 0.0, 1.0));
  }
  return columns;
}

MovedUv Move(const Columns& columns, Closure closure, int threads = 1,
             std::span<const Triangle> triangles = {}) {
  RunContext context;
  context.threads = threads;
  return MoveToFeet(Shape(closure), columns.View(), triangles, {.relaxation_rounds = 3}, context);
}

struct Sample {
  std::function<Vec3(const Vec2&)> surface;
  Closure closure;
};
const std::vector<Sample>& Samples() {
  static const std::vector<Sample> samples = {{FrankePoint, Closure::kOpen},
                                              {HeadPoint, Closure::kPeriodicU}};
  return samples;
}

TEST(FootMoves, DistancesFromTheCoarseSurfaceDoNotRiseAndPointsStayInTheDomain) {
  for (const Sample& sample : Samples()) {
    for (const double error : {0.0, 0.01}) {
      const Columns columns = Disturbed(sample.surface, sample.closure, 3000, 1e-3, error);
      const MovedUv moved = Move(columns, sample.closure);
      EXPECT_LE(moved.moves.rms_after_mm, moved.moves.rms_before_mm);
      EXPECT_LE(moved.moves.rounds, 3);
      for (const Vec2& uv : moved.uv) {
        EXPECT_TRUE((uv.array() >= 0).all() && (uv.array() <= 1).all()) << uv.transpose();
      }
    }
  }
}

TEST(FootMoves, NoByteDependsOnTheNumberOfThreads) {
  for (const Sample& sample : Samples()) {
    const Columns columns = Disturbed(sample.surface, sample.closure, 3000, 1e-3, 0.01);
    EXPECT_EQ(Move(columns, sample.closure, 1).uv, Move(columns, sample.closure, 2).uv);
  }
}

TEST(FootMoves, DisturbedUvComeNearToTheTrueOnes) {
  const Columns exact = Disturbed(HeadPoint, Closure::kPeriodicU, 5000, 0, 0),
                off = Disturbed(HeadPoint, Closure::kPeriodicU, 5000, 0, 0.01);
  const MovedUv moved = Move(off, Closure::kPeriodicU);
  const auto median_error = [&](const std::vector<Vec2>& uv) {
    std::vector<double> errors;
    for (std::size_t k = 0; k < uv.size(); ++k) {
      Vec2 way = uv[k] - exact.uv[k];
      way.x() -= std::round(way.x());
      errors.push_back(way.norm());
    }
    std::ranges::nth_element(errors, errors.begin() + std::ssize(errors) / 2);
    return errors[errors.size() / 2];
  };
  EXPECT_GT(moved.moves.rounds, 0);
  EXPECT_LT(median_error(moved.uv), 0.5 * median_error(off.uv));
}

// Without the moves the adaptive plan follows the errors of (u,v).
TEST(FootMoves, DisturbedUvTakeFewerVerticesAtTheSameTolerance) {
  for (const Sample& sample : Samples()) {
    const Columns off = Disturbed(sample.surface, sample.closure, 5000, 1e-4, 0.005);
    const MovedUv moved = Move(off, sample.closure);
    const auto vertices = [&](const std::vector<Vec2>& uv) {
      HSplineShape shape = Shape(sample.closure);
      shape.max_level = 4;
      const FitOptions options{.plan = AdaptivePlan{.tolerance_mm = 0.02, .finest = 4},
                               .terms = {PointTerm{}},
                               .solver = Solver::kFastest};
      const FitResult fit = Fit(StartSurface(shape, off.positions, uv),
                                ScatteredPoints{off.positions, uv, {}}, options, {});
      return fit.surface.Net(0).vertices.size() + fit.surface.Offsets().size();
    };
    EXPECT_LT(2 * vertices(moved.uv), vertices(off.uv));
  }
}

TEST(FootMoves, OutliersStay) {
  Columns columns = Disturbed(FrankePoint, Closure::kOpen, 3000, 1e-3, 0.005);
  for (std::size_t k = 0; k < columns.positions.size(); k += 100) {
    columns.positions[k].z() += 2;
  }
  const MovedUv moved = Move(columns, Closure::kOpen);
  for (std::size_t k = 0; k < columns.positions.size(); k += 100) {
    EXPECT_EQ(moved.uv[k], columns.uv[k]);
  }
}

// Each point of a grid moves by up to two cells.
TEST(FootMoves, NoTriangleTurnsOver) {
  const TriMesh mesh =
      testing::GridMesh([](const Vec2& uv) { return Vec3(uv.x(), uv.y(), 0); }, 20);
  for (const bool mirrored : {false, true}) {
    Random random(3);
    std::vector<Vec2> from, to;
    for (const Vec3& p : mesh.points) {
      from.emplace_back(mirrored ? 1 - p.x() : p.x(), p.y());
      const double u = random.Uniform(-0.1, 0.1), v = random.Uniform(-0.1, 0.1);
      to.emplace_back((from.back() + Vec2(u, v)).cwiseMax(0).cwiseMin(1));
    }
    EXPECT_GT(KeepFromFolding(Shape(Closure::kOpen), mesh.triangles, from, to), 100);
    for (const Triangle& t : mesh.triangles) {
      const Vec2 a = to[t[1]] - to[t[0]], b = to[t[2]] - to[t[0]];
      EXPECT_GT((mirrored ? -1 : 1) * (a.x() * b.y() - a.y() * b.x()), 0);
    }
    EXPECT_NE(to, from);
  }
}

// Triangles and moves across u = 1 are not folds.
TEST(FootMoves, TheSeamIsNotAFold) {
  const std::vector<Triangle> triangles = {{0, 1, 2}};
  const std::vector<Vec2> from = {{0.95, 0.4}, {0.05, 0.4}, {0.98, 0.6}};
  const std::vector<Vec2> wanted = {{0.96, 0.4}, {0.06, 0.4}, {0.01, 0.6}};
  std::vector<Vec2> to = wanted;
  EXPECT_EQ(KeepFromFolding(Shape(Closure::kPeriodicU), triangles, from, to), 0);
  EXPECT_EQ(to, wanted);
}

TEST(FootMoves, WithoutRoundsAndOfOtherFitsNothingMoves) {
  const Columns columns = Disturbed(FrankePoint, Closure::kOpen, 500, 1e-3, 0.01);
  const MovedUv none = MoveToFeet(Shape(Closure::kOpen), columns.View(), {}, AutoPlan{}, {});
  EXPECT_EQ(none.moves.rounds, 0);
  EXPECT_EQ(none.uv, columns.uv);
  const FitOptions options{.plan = AutoPlan{.relaxation_rounds = 1},
                           .terms = {PointTerm{}, SmoothnessTerm{.weight = AutoOr<double>::Auto()}},
                           .solver = Solver::kFastest};
  EXPECT_THROW(Fit(StartSurface(Shape(Closure::kOpen), columns.positions, columns.uv),
                   columns.View(), options, {}),
               InputError);
}

}  // namespace
}  // namespace semblance::fitting
