// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "fitting/seeding.h"
#include "surfaces/error.h"

namespace semblance {
namespace {

[[noreturn]] void Fail(const std::string& what) { throw InputError("fit: " + what); }

void CheckSchedule(const std::vector<LevelFit>& schedule, int max_level) {
  if (schedule.empty()) {
    Fail("the schedule is empty; give at least one {level, fraction}");
  }
  for (std::size_t i = 0; i < schedule.size(); ++i) {
    if (schedule[i].level < 0 || schedule[i].level > max_level) {
      Fail(fmt::format("step {} of the schedule asks for level {}; the surface has levels 0..{}", i,
                       schedule[i].level, max_level));
    }
    if (!(schedule[i].fraction >= 0 && schedule[i].fraction <= 1)) {
      Fail(fmt::format("step {} of the schedule has the fraction {}; allowed are 0..1", i,
                       schedule[i].fraction));
    }
  }
}

void CheckFeatures(std::span<const VertexId> features, int max_level) {
  for (const VertexId& f : features) {
    if (f.level < 1 || f.level > max_level) {
      Fail(
          fmt::format("feature vertex ({}, {}) is of level {}; features are offsets, of levels "
                      "1..{}",
                      f.i, f.j, f.level, max_level));
    }
  }
}

void CheckInput(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
                std::span<const VertexId> features, const FitOptions& options) {
  if (!(start.shape() == rest.shape())) {
    Fail("the start and the template differ in shape (patches, levels, closure or reference)");
  }
  if (target.points.empty()) {
    Fail("the target has no point; give dowels or seed some");
  }
  CheckTarget(target);
  CheckSchedule(options.schedule, start.shape().max_level);
  CheckFeatures(features, start.shape().max_level);
}

PatchGrid GridOf(const HSplineShape& shape, int level) {
  return {.patches_u = shape.PatchesU(level),
          .patches_v = shape.PatchesV(level),
          .periodic_u = shape.closure == Closure::kPeriodicU};
}

// The detail that finer levels add at uv is taken off the point that the level aims at.
Observation Observe(const FitPoint& point, const HSplineSurface& surface, int level, FitAim aim) {
  Observation o{.uv = point.uv, .position = point.position, .weight = point.weight};
  if (aim == FitAim::kSurface && level < surface.shape().max_level) {
    const Vec3 coarse = surface.StencilAt(level, point.uv).Apply(surface.Net(level));
    o.position -= surface.Point(point.uv) - coarse;
  }
  return o;
}

LevelView ViewOf(int level, const HSplineSurface& surface, const HSplineSurface& rest,
                 const FitTarget& target, FitAim aim) {
  LevelView view{.grid = GridOf(surface.shape(), level),
                 .start = surface.Net(level),
                 .rest = rest.Net(level),
                 .lengths_mm = MeanLengths(GridOf(rest.shape(), 0), rest.Net(0)),
                 .observations = {}};
  view.observations.reserve(target.points.size());
  for (const FitPoint& point : target.points) {
    view.observations.push_back(Observe(point, surface, level, aim));
  }
  return view;
}

// c + fraction (c' - c); a vertex that the solve left alone keeps its bits. Returns the longest
// way.
double WriteBack(const ControlNet& solved, const LevelFit& step, HSplineSurface& surface) {
  ControlNet net = surface.Net(step.level);
  double longest = 0;
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    const Vec3 move = step.fraction * (solved.vertices[k] - net.vertices[k]);
    net.vertices[k] += move;
    longest = std::max(longest, move.norm());
  }
  surface.SetNet(step.level, net);
  return longest;
}

// Sorted, so that no sum depends on the order in which points were given.
double WeightedRms(std::vector<std::array<double, 2>> weight_and_distance) {
  std::sort(weight_and_distance.begin(), weight_and_distance.end());
  double sum = 0, weights = 0;
  for (const auto& [weight, distance] : weight_and_distance) {
    sum += weight * distance * distance;
    weights += weight;
  }
  return weights > 0 ? std::sqrt(sum / weights) : kNaN;
}

double PointRms(const HSplineSurface& surface, const FitTarget& target) {
  std::vector<std::array<double, 2>> all;
  for (const FitPoint& p : target.points) {
    all.push_back({p.weight, (surface.Point(p.uv) - p.position).norm()});
  }
  return WeightedRms(std::move(all));
}

LevelSummary FitStep(const LevelFit& step, const HSplineSurface& rest, const FitTarget& target,
                     const FitOptions& options, HSplineSurface& surface) {
  const double rms_before_mm = PointRms(surface, target);
  LevelSolution solution =
      FitLevel(ViewOf(step.level, surface, rest, target, options.aim), options.terms);
  LevelSummary summary = std::move(solution.summary);
  summary.level = step.level;
  summary.fraction = step.fraction;
  summary.max_move_mm = WriteBack(solution.net, step, surface);
  summary.rms_before_mm = rms_before_mm;
  summary.rms_after_mm = PointRms(surface, target);
  return summary;
}

int RestoreFeatures(const HSplineSurface& rest, std::span<const VertexId> features,
                    HSplineSurface& surface) {
  std::map<VertexId, std::optional<Vec3>> offsets;
  for (const VertexId& feature : features) {
    offsets[feature] = rest.Offset(feature);
  }
  surface.SetOffsets(offsets);
  return static_cast<int>(offsets.size());
}

void MeasurePoints(const FitTarget& target, FitResult& result) {
  FitTarget dowels;
  for (const FitPoint& p : target.points) {
    result.residual_mm.push_back((result.surface.Point(p.uv) - p.position).norm());
    if (!IsSeeded(p)) {
      dowels.points.push_back(p);
    }
  }
  result.point_rms_mm = PointRms(result.surface, target);
  result.dowel_rms_mm = PointRms(result.surface, dowels);
  result.usable = std::all_of(result.levels.begin(), result.levels.end(),
                              [](const LevelSummary& s) { return s.usable; });
}

}  // namespace

FitResult Fit(const HSplineSurface& start, const HSplineSurface& rest, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options,
              const RunContext& context) {
  CheckInput(start, rest, target, features, options);
  FitResult result{.surface = start};
  for (const LevelFit& step : options.schedule) {
    context.ThrowIfStopped();
    context.Report(
        "fit", fmt::format("level {}, fraction {}", step.level, step.fraction),
        static_cast<double>(result.levels.size()) / static_cast<double>(options.schedule.size()));
    result.levels.push_back(FitStep(step, rest, target, options, result.surface));
  }
  const bool restore = options.features == FeatureRule::kRestore;
  result.restored_features = restore ? RestoreFeatures(rest, features, result.surface) : 0;
  MeasurePoints(target, result);
  return result;
}

FitResult Fit(const HSplineSurface& start, const FitTarget& target,
              std::span<const VertexId> features, const FitOptions& options,
              const RunContext& context) {
  return Fit(start, start, target, features, options, context);
}

}  // namespace semblance
