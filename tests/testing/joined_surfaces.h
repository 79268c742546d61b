// SPDX-License-Identifier: GPL-3.0-or-later
// Square surfaces of one graph over a plane, side by side in every way, for tests of joins.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "fitting/fit.h"
#include "fitting/problem/start_surface.h"
#include "problems/points/fit_joins.h"
#include "tests/testing/scattered_data.h"

namespace semblance::testing {

// Waves that no spline of a few patches follows exactly.
inline Vec3 WavyPoint(const Vec2& place) {
  return {place.x(), place.y(), 0.2 * std::sin(2 * place.x() + place.y()) * std::cos(place.y())};
}

// Where a surface beside the unit square, joined to its edge `its_edge`, has its (u,v): its edge
// `edge` lies on the square's, and it goes outwards from there.
inline Vec2 PlaceBeside(const SurfaceJoin& join, const Vec2& uv) {
  const int along = RunsAlongV(join.edge) ? 1 : 0, across = 1 - along;
  const double t = uv[along], out = std::abs(uv[across] - OnEdge(join.edge, t)[across]);
  const Vec2 on_edge = OnEdge(join.its_edge, join.reversed ? 1 - t : t);
  const Vec2 outwards = OnEdge(join.its_edge, 0.5) - Vec2(0.5, 0.5);  // of length 1/2
  return on_edge + 2 * out * outwards;
}

// Over the unit square, or where `place` puts it.
using PlaceOf = std::function<Vec2(const Vec2&)>;
inline FitTarget WavyTarget(const PlaceOf& place, int count, double noise,
                            std::uint64_t random_seed) {
  return Scattered([&](const Vec2& uv) { return WavyPoint(place(uv)); }, count, noise, random_seed);
}

struct NewSurface {
  int patches_u = 4, patches_v = 4;
  SchedulePlan plan = AdaptivePlan{.tolerance_mm = 0.02, .finest = 3};
};

inline FitOptions OptionsOf(const NewSurface& shape) {
  return {.plan = shape.plan,
          .terms = {PointTerm{}, SmoothnessTerm{.weight = AutoOr<double>::Auto(), .length_mm = 1}},
          .solver = Solver::kFastest};
}

inline HSplineSurface StartOf(const FitTarget& target, const NewSurface& shape) {
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;
  for (const FitPoint& p : target.points) {
    positions.push_back(p.position);
    uv.push_back(p.uv);
  }
  return StartSurface({.patches_u = shape.patches_u,
                       .patches_v = shape.patches_v,
                       .max_level = FinestLevelOf(shape.plan)},
                      positions, uv);
}

inline FitResult FreeFit(const FitTarget& target, const NewSurface& shape) {
  return Fit(StartOf(target, shape), target, {}, OptionsOf(shape), {});
}
inline JoinedFit JoinFit(const FitTarget& target, const std::vector<OpenedJoin>& joins,
                         const NewSurface& shape, int threads = 1) {
  RunContext context;
  context.threads = threads;
  return FitJoined(StartOf(target, shape), target, joins, OptionsOf(shape), context);
}

inline OpenedJoin Opened(const HSplineSurface& surface, const SurfaceJoin& join) {
  OpenedJoin opened{.join = join, .sha256 = "", .surface = surface};
  opened.join.surface = "given.hspline.json";
  return opened;
}

// Of the points with `inside`, NaN where none has.
template <class Inside>
double RmsWhere(const FitTarget& target, const FitResult& fit, const Inside& inside) {
  double sum = 0;
  int count = 0;
  for (std::size_t k = 0; k < target.points.size(); ++k) {
    if (inside(target.points[k].uv)) {
      sum += fit.residual_mm[k] * fit.residual_mm[k];
      ++count;
    }
  }
  return std::sqrt(sum / count);
}

}  // namespace semblance::testing
