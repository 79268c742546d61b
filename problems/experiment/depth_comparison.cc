// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/depth_comparison.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "interp/evaluation/scores.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

// The scores over the vertices with counts(v).
DepthScores ScoreWhere(const DepthErrors& errors, const DepthField& depth,
                       const std::vector<double>& areas_mm2,
                       const std::function<bool(std::size_t)>& counts) {
  std::vector<double> error_mm = errors.error_mm;
  for (std::size_t v = 0; v < error_mm.size(); ++v) {
    error_mm[v] = counts(v) ? error_mm[v] : kNaN;
  }
  return ScoreDepths(error_mm, depth.sd_mm, areas_mm2);
}

void Score(const FaceRegion& region, const DepthField& depth, const std::vector<double>& areas_mm2,
           DepthErrors& errors) {
  errors.scores = ScoreDepths(errors.error_mm, depth.sd_mm, areas_mm2);
  errors.scheme_scores = ScoreWhere(errors, depth, areas_mm2, [&](std::size_t v) {
    return depth.status[v] == DepthStatus::kAssigned;
  });
  for (const auto& [name, summary] : errors.regions) {
    const auto part = std::ranges::find(kFaceParts, name) - kFaceParts.begin();
    errors.region_scores[name] = ScoreWhere(errors, depth, areas_mm2, [&](std::size_t v) {
      return region.part[v] == static_cast<int>(part);
    });
  }
}

DepthErrors ErrorsAgainst(const TruthMap& truth, const FaceRegion& region, const DepthField& depth,
                          const std::vector<double>& areas_mm2) {
  DepthErrors errors;
  errors.error_mm.assign(areas_mm2.size(), kNaN);
  for (std::size_t v = 0; v < areas_mm2.size(); ++v) {
    if (region.scored[v]) {
      ++errors.vertices[truth.status[v]];
      errors.error_mm[v] = depth.depth_mm[v] - truth.depth_mm[v];
    }
  }
  errors.all = SummarizeDistances(errors.error_mm, areas_mm2, [](std::size_t) { return true; });
  errors.regions = SummarizeParts(errors.error_mm, areas_mm2, region);
  errors.coverage = Coverage(errors.error_mm, depth.sd_mm, areas_mm2);
  errors.coverage_90 = CoverageAt90(errors.coverage);
  Score(region, depth, areas_mm2, errors);
  return errors;
}

// Distances from the ends of the depths to the closest skin, where the true depth along the
// direction is known.
std::vector<double> TipErrors(const DepthStage& stage, const DepthComparison& comparison,
                              const RunContext& context) {
  const TriMesh& skin = *stage.subject.skin;
  const MeshQuery query(skin);
  std::vector<double> error(stage.shell.points.size(), kNaN);
  ParallelFor(error.size(), context.threads, 256, [&](std::size_t v) {
    const double signed_mm = comparison.along_direction.error_mm[v];
    if (std::isfinite(signed_mm)) {
      const Vec3 tip = stage.shell.points[v] + stage.depth.depth_mm[v] * comparison.directions[v];
      error[v] = std::copysign(query.Closest(tip).distance_mm, signed_mm);
    }
  });
  return error;
}

void MakeVariogram(const DepthStage& stage, const std::vector<double>& areas_mm2,
                   DepthComparison& comparison) {
  constexpr double kBin_mm = 5, kReach_mm = 60;  // smaller bins are noisier
  std::vector<double> depth_mm = comparison.truth.along_direction.depth_mm;
  for (std::size_t v = 0; v < depth_mm.size(); ++v) {
    depth_mm[v] = comparison.region.scored[v] ? depth_mm[v] : kNaN;
  }
  comparison.variogram =
      EmpiricalVariogram(stage.shell.points, depth_mm, areas_mm2, kBin_mm, kReach_mm);
  comparison.variogram_model = FitVariogram(comparison.variogram);
}

}  // namespace

DepthComparison CompareDepths(const Experiment& experiment, const DepthStage& stage,
                              const DepthField& depth, const RunContext& context) {
  DepthComparison comparison;
  comparison.region =
      InFrontOfNetwork(stage.shell, stage.scored_on_shell, stage.subject.scored_network,
                       stage.subject.basis.sites->points, experiment.region);
  comparison.directions = DepthDirections(experiment.direction, stage.Input(), context);
  comparison.truth = MeasureDepthTruth(stage.shell, comparison.directions, *stage.subject.skin,
                                       experiment.depth_truth, context);
  const std::vector<double> areas = VertexAreas(stage.shell);
  comparison.along_direction =
      ErrorsAgainst(comparison.truth.along_direction, comparison.region, depth, areas);
  comparison.closest = ErrorsAgainst(comparison.truth.closest, comparison.region, depth, areas);
  MakeVariogram(stage, areas, comparison);
  comparison.tips = SummarizeDistances(TipErrors(stage, comparison, context), areas,
                                       [](std::size_t) { return true; });
  return comparison;
}

}  // namespace semblance::problems
