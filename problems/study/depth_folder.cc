// SPDX-License-Identifier: GPL-3.0-or-later
// The files of a measured depth.
#include <fmt/format.h>

#include "problems/pictures/pictures.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/report/timing_json.h"
#include "problems/study/depth_study.h"
#include "surfaces/mesh/mesh_io.h"

namespace semblance {
namespace {

std::string DepthPly(const DepthResult& result) {
  const DepthField& depth = result.stage->depth;
  MeshAttributes attributes;
  attributes.scalars = {{"quality", depth.depth_mm},
                        {"scalar_depth_mm", depth.depth_mm},
                        {"scalar_sd_mm", depth.sd_mm}};
  if (result.truth) {
    const DepthComparison& truth = *result.truth;
    attributes.scalars.push_back(
        {"scalar_true_along_direction_mm", truth.truth.along_direction.depth_mm});
    attributes.scalars.push_back({"scalar_true_closest_mm", truth.truth.closest.depth_mm});
    attributes.scalars.push_back(
        {"scalar_error_along_direction_mm", truth.along_direction.error_mm});
    attributes.scalars.push_back({"scalar_error_closest_mm", truth.closest.error_mm});
  }
  return EncodeMesh(result.stage->shell, ".ply", attributes);
}

// The shell moved by its depth, where it has one at all three corners (thesis 2.2: the soft tissue
// at p + depth * direction).
std::string TipsPly(const DepthResult& result) {
  TriMesh tips = result.stage->shell;
  const std::vector<double>& depth_mm = result.stage->depth.depth_mm;
  for (std::size_t v = 0; v < tips.points.size(); ++v) {
    tips.points[v] += (std::isfinite(depth_mm[v]) ? depth_mm[v] : 0) * result.directions[v];
  }
  std::vector<bool> keep;
  for (const Triangle& t : tips.triangles) {
    keep.push_back(std::isfinite(depth_mm[t[0]] + depth_mm[t[1]] + depth_mm[t[2]]));
  }
  return EncodeMesh(Submesh(tips, keep), ".ply");
}

}  // namespace

std::string DepthPicture(const DepthResult& result, const std::string& title, int threads) {
  constexpr double kDeepest_mm = 25, kWorst_mm = 4;
  constexpr std::array kViews = {View::kFront, View::kThreeQuarter};
  const RenderOptions options{.width = 420, .height = 480, .lighting = Lighting::kEven};
  const TriMesh& shell = result.stage->shell;
  const Legend depth{SequentialMap(0, kDeepest_mm), "interpolated tissue depth"};
  std::vector<Image> rows = {
      RenderViews({{MappedObject(shell, result.stage->depth.depth_mm, depth.map)}}, Bounds(shell),
                  kViews, {title, {}, depth}, options, threads)};
  if (result.truth) {
    const Legend error{DivergingMap(kWorst_mm), "too deep (+) or not deep enough (-)"};
    rows.push_back(RenderViews(
        {{MappedObject(shell, result.truth->along_direction.error_mm, error.map)}}, Bounds(shell),
        kViews, {"error against the true skin", {}, error}, options, threads));
  }
  return EncodePng(ContactSheet(rows, {"", {}, std::nullopt}));
}

void WriteDepth(const Experiment& experiment, const DepthResult& result, OutputFolder& folder,
                const RunContext& context) {
  folder.Write("resolved.yaml", WriteConfig(experiment));
  folder.Write("result.json", DepthResultJson(experiment, result));
  folder.Write("left_out.csv", LeftOutCsv(result));
  folder.Write("depth.ply", DepthPly(result));
  folder.Write("tips.ply", TipsPly(result));
  folder.Write("depth.png", DepthPicture(result, experiment.title, context.threads));
  folder.Write("timing.json", TimingJson(result.times));
}

}  // namespace semblance
