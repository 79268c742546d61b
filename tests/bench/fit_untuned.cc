// SPDX-License-Identifier: GPL-3.0-or-later
// The fit that is told nothing, against peers that are told what is best for them: MBA with the
// number of levels, and FITPACK with the number of patches, whose error against the truth is least.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "fitting/fit.h"
#include "fitting/problem/start_surface.h"
#include "surfaces/hspline_query/hspline_batch.h"
#include "tests/bench/fit_parts.h"
#include "tests/bench/mba.h"
#include "tests/bench/peer_program.h"
#include "tests/testing/point_sets.h"

namespace semblance::bench {
using namespace problems;
namespace {

using testing::PointSet;

constexpr int kSide = 400;

std::vector<Vec2> ScoredGrid(const PointSet& set) {
  std::vector<Vec2> grid;
  for (int k = 0; k < kSide * kSide; ++k) {
    const Vec2 uv((k % kSide + 0.5) / kSide, (k / kSide + 0.5) / kSide);
    if (set.scored(uv)) {
      grid.push_back(uv);
    }
  }
  return grid;
}

double RmsOf(const PointSet& set, const std::vector<Vec2>& grid, const std::vector<Vec3>& found) {
  double sum = 0;
  for (std::size_t k = 0; k < grid.size(); ++k) {
    sum += (found[k] - set.truth(grid[k])).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(grid.size()));
}

Measured FitUntuned(const PointSet& set, int count) {
  const FitTarget target = testing::Draw(set, count, 7);
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;
  for (const FitPoint& p : target.points) {
    positions.push_back(p.position);
    uv.push_back(p.uv);
  }
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 0, .closure = set.closure};
  const double begin = CpuSecondsSoFar();
  const FitResult fit =
      Fit(StartSurface(shape, positions, uv), target, {},
          {.plan = AutoPlan{},
           .terms = {PointTerm{}, SmoothnessTerm{.weight = AutoOr<double>::Auto()}},
           .solver = Solver::kFastest},
          {});
  Measured measured;
  measured.seconds = CpuSecondsSoFar() - begin;
  measured.peak_mb = PeakMb();
  const std::vector<Vec2> grid = ScoredGrid(set);
  measured.rms_mm = RmsOf(set, grid, HSplineBatch(fit.surface).Points(grid, 1));
  measured.vertices = static_cast<double>(fit.surface.Net(0).vertices.size()) +
                      static_cast<double>(fit.surface.Offsets().size());
  return measured;
}

// Each coordinate by itself; of a height field z alone, for x and y are u and v.
Measured Mba(const PointSet& set, int count, int levels) {
  const FitTarget target = testing::Draw(set, count, 7);
  const std::vector<Vec2> grid = ScoredGrid(set);
  std::vector<Vec3> found(grid.size());
  Measured measured{.seconds = 0};
  for (int c = 0; c < 3; ++c) {
    if (set.closure == Closure::kOpen && c < 2) {
      for (std::size_t k = 0; k < grid.size(); ++k) {
        found[k][c] = grid[k][c];
      }
      continue;
    }
    std::vector<HeightPoint> points;
    for (const FitPoint& p : target.points) {
      points.push_back({p.uv.x(), p.uv.y(), p.position[c]});
    }
    const double begin = CpuSecondsSoFar();
    const MultilevelBSpline spline(std::move(points), levels);
    measured.seconds += CpuSecondsSoFar() - begin;
    for (std::size_t k = 0; k < grid.size(); ++k) {
      found[k][c] = spline.Height(grid[k].x(), grid[k].y());
    }
  }
  measured.rms_mm = RmsOf(set, grid, found);
  return measured;
}

Measured BestMba(const PointSet& set, int count) {
  Measured best;
  for (int levels = 4; levels <= 11; ++levels) {
    const Measured measured = MeasureApart([&] { return Mba(set, count, levels); });
    best = measured.rms_mm >= best.rms_mm ? best : measured;
  }
  return best;
}

// NaN without python3-scipy, and for more than 1e5 points, which take it minutes.
Measured BestFitpack(const PointSet& set, int count) {
  if (count > 100000) {
    return {};
  }
  std::vector<double> points, grid;
  for (const FitPoint& p : testing::Draw(set, count, 7).points) {
    points.insert(points.end(),
                  {p.uv.x(), p.uv.y(), p.position.x(), p.position.y(), p.position.z()});
  }
  for (const Vec2& uv : ScoredGrid(set)) {
    const Vec3 p = set.truth(uv);
    grid.insert(grid.end(), {uv.x(), uv.y(), p.x(), p.y(), p.z()});
  }
  const PeerFiles files({{"points", points}, {"grid", grid}});
  return AskScipy(fmt::format("'{}' {} 6 8 10 12 16 20 24 32 48 64", SEMBLANCE_FITPACK_UNTUNED_PEER,
                              files.Names()));
}

void RunSet(const PointSet& set, int count, const std::string& suffix) {
  const Measured ours = MeasureApart([&] { return FitUntuned(set, count); });
  const Measured mba = BestMba(set, count), fitpack = BestFitpack(set, count);
  const double best = std::fmin(mba.rms_mm, fitpack.rms_mm);
  const std::string name = "fit.untuned." + set.name + suffix;
  // Print's goal is of the peer's error over ours: at most 1.1 times the best.
  Print(name + "_rms_vs_best_peer", ours.rms_mm, best, 1 / 1.1, "mm");
  Print(name + "_seconds", ours.seconds, kNaN, kNaN, "s");
  fmt::print(stderr,
             "{} {} points: ours {:.2e} in {:.2f} s with {:.0f} vertices; MBA {:.2e} in {:.2f} s; "
             "FITPACK {:.2e} in {:.1f} s\n",
             set.name, count, ours.rms_mm, ours.seconds, ours.vertices, mba.rms_mm, mba.seconds,
             fitpack.rms_mm, fitpack.seconds);
}

}  // namespace

void RunUntuned() {
  for (const PointSet& set : testing::PointSets()) {
    RunSet(set, 100000, "");
    RunSet(set, 10000, "_1e4");
    RunSet(set, 1000000, "_1e6");
  }
}

}  // namespace semblance::bench
