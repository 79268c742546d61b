// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/relaxation/foot_moves.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "fitting/nested/nested_fit.h"
#include "fitting/problem/start_surface.h"
#include "surfaces/base/parallel.h"
#include "surfaces/hspline_query/hspline_batch.h"
#include "surfaces/hspline_query/hspline_project.h"

namespace semblance::fitting {
namespace {

constexpr int kFinestLevel = 2;     // of the coarse fit; finer levels cost more and change little
constexpr double kMoveRatio = 0.1;  // moves below this share of the distances end the rounds
constexpr double kFootTolerance = 0.01;  // of a foot, relative to the noise

// The way from one (u,v) to another, the shorter one along a closed u.
Vec2 ShortestWay(const HSplineShape& shape, const Vec2& from, const Vec2& to) {
  Vec2 way = to - from;
  way.x() -= shape.ClosedU() ? std::round(way.x()) : 0;
  return way;
}

Vec2 HalfWay(const HSplineShape& shape, const Vec2& from, const Vec2& to) {
  const Vec2 middle = from + ShortestWay(shape, from, to) / 2;
  return {IntoUnit(middle.x(), shape.ClosedU()), std::clamp(middle.y(), 0.0, 1.0)};
}

// Twice the area of a triangle in (u,v), negative if it runs clockwise.
double AreaOnMap(const HSplineShape& shape, const Triangle& t, std::span<const Vec2> uv) {
  const Vec2 a = ShortestWay(shape, uv[t[0]], uv[t[1]]), b = ShortestWay(shape, uv[t[0]], uv[t[2]]);
  return a.x() * b.y() - a.y() * b.x();
}

// The triangles with the majority's orientation, turned counter-clockwise.
std::vector<Triangle> MajorityTriangles(const HSplineShape& shape,
                                        std::span<const Triangle> triangles,
                                        std::span<const Vec2> uv) {
  const auto mirrored = std::ranges::count_if(
      triangles, [&](const Triangle& t) { return AreaOnMap(shape, t, uv) < 0; });
  const double sense = 2 * mirrored > std::ssize(triangles) ? -1 : 1;
  std::vector<Triangle> kept;
  for (const Triangle& t : triangles) {
    if (sense * AreaOnMap(shape, t, uv) > 0) {
      kept.push_back(sense > 0 ? t : Triangle{t[0], t[2], t[1]});
    }
  }
  return kept;
}

// A coarse surface with the points' feet on it.
struct OnCoarse {
  HSplineSurface surface;
  std::vector<Vec2> uv, feet;
  std::vector<double> distance_mm;  // from the point to its foot
  std::vector<double> move_mm;      // from S(uv) to the foot
  std::vector<char> outlier;
};

class FootMover {
 public:
  FootMover(const HSplineShape& shape, const ScatteredPoints& points,
            std::span<const Triangle> triangles, const AutoPlan& plan, const RunContext& context)
      : shape_(shape), points_(points), triangles_(triangles), plan_(plan), context_(context) {}

  MovedUv Run() {
    const OnCoarse first = Fit({points_.uv.begin(), points_.uv.end()});
    OnCoarse last = first;
    for (moves_.rounds = 0; moves_.rounds < plan_.relaxation_rounds && !HasConverged(last);) {
      context_.ThrowIfStopped();
      int folds_prevented = 0;
      OnCoarse next = Fit(Moved(last, folds_prevented));
      if (!IsNearer(next, last) || !IsNearer(next, first)) {
        break;
      }
      last = std::move(next);
      ++moves_.rounds;
      moves_.folds_prevented += folds_prevented;
    }
    SetStatistics(first, last);
    return {std::move(last.uv), moves_};
  }

 private:
  OnCoarse Fit(std::vector<Vec2> uv) {
    context_.Report("relaxation", fmt::format("round {}", moves_.rounds + 1));
    AutoPlan coarse = plan_;
    coarse.finest = std::min(plan_.finest, kFinestLevel);
    NestedFitResult fit = FitNested(StartSurface(shape_, points_.positions, uv),
                                    {points_.positions, uv, points_.weights}, coarse, context_);
    OnCoarse on{std::move(fit.surface), std::move(uv),  /*feet=*/{},
                /*distance_mm=*/{},     /*move_mm=*/{}, {}};
    on.outlier.assign(on.uv.size(), 0);
    for (const std::uint32_t k : fit.report.outliers) {
      on.outlier[k] = 1;
    }
    Project(kFootTolerance * fit.report.noise_mm, on);
    return on;
  }

  void Project(double tolerance_mm, OnCoarse& on) const {
    constexpr std::size_t kBlock = 256;          // points per task of a thread
    constexpr double kMinTolerance_mm = 1e-300;  // 0 is not allowed
    const ProjectOptions options{.tolerance_mm = std::max(tolerance_mm, kMinTolerance_mm)};
    const std::vector<Vec3> places = HSplineBatch(on.surface).Points(on.uv, context_.threads);
    on.feet.resize(on.uv.size());
    on.distance_mm.resize(on.uv.size());
    on.move_mm.resize(on.uv.size());
    ParallelFor(on.uv.size(), context_.threads, kBlock, [&](std::size_t k) {
      const SurfaceProjection foot =
          ProjectFrom(on.surface, points_.positions[k], on.uv[k], options);
      on.feet[k] = foot.uv;
      on.distance_mm[k] = foot.distance_mm;
      on.move_mm[k] = (foot.point - places[k]).norm();
    });
  }

  // The feet; outliers stay, because they do not belong to this surface.
  std::vector<Vec2> Moved(const OnCoarse& on, int& folds_prevented) const {
    std::vector<Vec2> uv = on.feet;
    for (std::size_t k = 0; k < uv.size(); ++k) {
      uv[k] = on.outlier[k] != 0 ? on.uv[k] : uv[k];
    }
    folds_prevented = KeepFromFolding(shape_, triangles_, on.uv, uv);
    return uv;
  }

  // The weighted root mean square over points that are outliers of neither a nor b.
  double Rms(std::span<const double> lengths_mm, const OnCoarse& a, const OnCoarse& b) const {
    double sum = 0, weights = 0;
    for (std::size_t k = 0; k < lengths_mm.size(); ++k) {
      if (a.outlier[k] == 0 && b.outlier[k] == 0) {
        sum += points_.Weight(k) * lengths_mm[k] * lengths_mm[k];
        weights += points_.Weight(k);
      }
    }
    return std::sqrt(sum / weights);
  }

  bool HasConverged(const OnCoarse& on) const {
    return Rms(on.move_mm, on, on) <= kMoveRatio * Rms(on.distance_mm, on, on);
  }

  bool IsNearer(const OnCoarse& next, const OnCoarse& before) const {
    return Rms(next.distance_mm, next, before) < Rms(before.distance_mm, next, before);
  }

  void SetStatistics(const OnCoarse& first, const OnCoarse& last) {
    moves_.rms_before_mm = Rms(first.distance_mm, first, last);
    moves_.rms_after_mm = Rms(last.distance_mm, first, last);
    const HSplineBatch batch(last.surface);
    const std::vector<Vec3> from = batch.Points(first.uv, context_.threads),
                            to = batch.Points(last.uv, context_.threads);
    std::vector<double> ways_mm;
    for (std::size_t k = 0; k < from.size(); ++k) {
      ways_mm.push_back((to[k] - from[k]).norm());
    }
    moves_.rms_move_mm = Rms(ways_mm, first, last);
    moves_.max_move_mm = std::ranges::max(ways_mm);
  }

  const HSplineShape& shape_;
  const ScatteredPoints& points_;
  std::span<const Triangle> triangles_;
  const AutoPlan& plan_;
  const RunContext& context_;
  FootMoves moves_;
};

}  // namespace

MovedUv MoveToFeet(const HSplineShape& shape, const ScatteredPoints& points,
                   std::span<const Triangle> triangles, const AutoPlan& plan,
                   const RunContext& context) {
  CheckPoints(points);
  return FootMover(shape, points, triangles, plan, context).Run();
}

int KeepFromFolding(const HSplineShape& shape, std::span<const Triangle> triangles,
                    std::span<const Vec2> from, std::span<Vec2> to) {
  constexpr int kMaxHalvings = 6;  // then a move is dropped; 1/64 of it is not worth more passes
  const std::vector<Triangle> kept = MajorityTriangles(shape, triangles, from);
  int prevented = 0;
  for (int pass = 0;; ++pass) {
    std::vector<char> moves_less(to.size(), 0);
    int turned = 0;
    for (const Triangle& t : kept) {
      if (!(AreaOnMap(shape, t, to) > 0)) {
        ++turned;
        for (const std::int32_t corner : t) {
          moves_less[corner] = 1;
        }
      }
    }
    if (turned == 0) {
      return prevented;
    }
    prevented = pass == 0 ? turned : prevented;
    for (std::size_t k = 0; k < to.size(); ++k) {
      if (moves_less[k] != 0) {
        to[k] = pass < kMaxHalvings ? HalfWay(shape, from[k], to[k]) : from[k];
      }
    }
  }
}

}  // namespace semblance::fitting
