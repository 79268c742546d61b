// SPDX-License-Identifier: GPL-3.0-or-later
// Moves of (u,v) before the fit that is told nothing: (u,v) that are given but off by a hundredth
// of the domain, and such as are found, each with and without.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "fitting/fit.h"
#include "fitting/parameters/parametrise.h"
#include "fitting/problem/start_surface.h"
#include "fitting/relaxation/foot_moves.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "tests/bench/fit_parts.h"
#include "tests/testing/point_sets.h"

namespace semblance::bench {
using namespace problems;
namespace {

using testing::PointSet;

constexpr int kPoints = 20000, kRounds = 3;

struct Feet {
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;
};

HSplineShape ShapeOf(const PointSet& set) {
  return {.patches_u = 8, .patches_v = 8, .max_level = 0, .closure = set.closure};
}

// With the set's noise in each coordinate.
Feet PointsOf(const PointSet& set) {
  Random random(7);
  Feet points;
  for (int k = 0; k < kPoints; ++k) {
    points.uv.push_back(set.place(random));
    const Vec3 off(random.Normal(), random.Normal(), random.Normal());
    points.positions.push_back(set.truth(points.uv.back()) + set.noise * off);
  }
  return points;
}

void Disturb(const HSplineShape& shape, std::vector<Vec2>& uv) {
  constexpr double kError = 0.01;
  Random random(8);
  for (Vec2& p : uv) {
    const double u = p.x() + kError * random.Normal(), v = p.y() + kError * random.Normal();
    p = {IntoUnit(u, shape.ClosedU()), std::clamp(v, 0.0, 1.0)};
  }
}

// Of the true surface, but for a fiftieth along each side.
double DistanceOfTruth(const PointSet& set, const HSplineSurface& surface) {
  constexpr int kSide = 48;
  const SurfaceProjector projector(surface, {.samples_per_patch = 1});
  double sum = 0;
  for (int k = 0; k < kSide * kSide; ++k) {
    const Vec2 cell((k % kSide + 0.5) / kSide, (k / kSide + 0.5) / kSide);
    const double distance =
        projector.Project(set.truth(Vec2(0.02, 0.02) + 0.96 * cell)).distance_mm;
    sum += distance * distance / (kSide * kSide);
  }
  return std::sqrt(sum);
}

Measured FitMoved(const PointSet& set, bool disturbed, int rounds) {
  const HSplineShape shape = ShapeOf(set);
  Feet points = PointsOf(set);
  if (disturbed) {
    Disturb(shape, points.uv);
  } else {
    points.uv = Parametrise({.positions = points.positions, .closure = set.closure}).uv;
  }
  const double begin = CpuSecondsSoFar();
  if (rounds > 0) {
    points.uv =
        MoveToFeet(shape, {points.positions, points.uv, {}}, {}, {.relaxation_rounds = rounds}, {})
            .uv;
  }
  const FitResult fit =
      Fit(StartSurface(shape, points.positions, points.uv),
          ScatteredPoints{points.positions, points.uv, {}},
          {.plan = AutoPlan{},
           .terms = {PointTerm{}, SmoothnessTerm{.weight = AutoOr<double>::Auto()}},
           .solver = Solver::kFastest},
          {});
  return {.seconds = CpuSecondsSoFar() - begin,
          .peak_mb = PeakMb(),
          .rms_mm = DistanceOfTruth(set, fit.surface),
          .vertices = static_cast<double>(fit.surface.Net(0).vertices.size()) +
                      static_cast<double>(fit.surface.Offsets().size())};
}

void RunSet(const PointSet& set, bool disturbed) {
  const Measured as_is = MeasureApart([&] { return FitMoved(set, disturbed, 0); }),
                 moved = MeasureApart([&] { return FitMoved(set, disturbed, kRounds); });
  const std::string name =
      fmt::format("fit.feet.{}_{}", set.name, disturbed ? "disturbed" : "found");
  Print(name + "_rms_vs_unmoved", moved.rms_mm, as_is.rms_mm, kNaN, "mm");
  Print(name + "_seconds", moved.seconds, kNaN, kNaN, "s");
  fmt::print(stderr,
             "{} {}: as they are {:.2e} with {:.0f} vertices in {:.2f} s; moved {:.2e} with {:.0f} "
             "in {:.2f} s\n",
             set.name, disturbed ? "off by 1 %" : "found", as_is.rms_mm, as_is.vertices,
             as_is.seconds, moved.rms_mm, moved.vertices, moved.seconds);
}

}  // namespace

void RunFeet() {
  for (const PointSet& set : testing::PointSets()) {
    if (set.outliers == 0 && set.noise > 0) {
      RunSet(set, /*disturbed=*/true);
      RunSet(set, /*disturbed=*/false);
    }
  }
}

}  // namespace semblance::bench
