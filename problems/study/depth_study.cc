// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/depth_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "problems/config/terminal_text.h"
#include "problems/experiment/experiment_config.h"
#include "problems/report/pictures/pictures.h"
#include "problems/report/result_json.h"
#include "problems/subject/sites.h"
#include "surfaces/base/csv.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::pair<std::string, Folds>> KindsOfFolds(const CrossValidationOptions& options,
                                                        std::span<const Dowel> dowels) {
  std::vector<std::pair<std::string, Folds>> kinds = {
      {"landmark", EachLandmark(dowels)},
      {"side", EachSide(dowels)},
      {"k_fold", RandomFolds(dowels, options.folds, options.random_seed)}};
  std::erase_if(kinds, [&](const auto& kind) {
    return std::ranges::any_of(kind.second,
                               [&](const auto& fold) { return fold.size() >= dowels.size(); });
  });
  return kinds;
}

std::vector<std::pair<std::string, CrossValidation>> LeaveOut(const Experiment& experiment,
                                                              const DepthStage& stage,
                                                              const RunContext& context) {
  std::vector<std::pair<std::string, CrossValidation>> left_out;
  for (const auto& [kind, folds] :
       KindsOfFolds(experiment.cross_validation, stage.dowels_on_shell)) {
    left_out.emplace_back(kind, CrossValidate(WayToDepth(experiment), experiment.outside,
                                              stage.Input(), folds, context));
  }
  return left_out;
}

const char* StatusWord(DepthStatus status) {
  return status == DepthStatus::kAssigned  ? "assigned"
         : status == DepthStatus::kOutside ? "outside"
                                           : "not_facing";
}

std::string SummaryLine(const char* what, const DistanceSummary& s) {
  return fmt::format("{:<26} {:6.2f} {:6.2f} {:6.2f} {:7.2f} {:9.0f}\n", what, s.rms_mm,
                     s.mean_abs_mm, s.p95_mm, s.mean_signed_mm, s.area_cm2);
}

std::string TruthText(const DepthComparison& truth) {
  std::string text = "depth against the true skin      RMS   mean    p95  signed  cm² scored\n" +
                     SummaryLine("  along the direction", truth.along_direction.all);
  for (const auto& [name, summary] : truth.along_direction.regions) {
    text += SummaryLine(fmt::format("    {}", name).c_str(), summary);
  }
  text += SummaryLine("  to the closest skin", truth.closest.all);
  return text + SummaryLine("  the depth's end", truth.tips);
}

// Writes the variogram of the true depth by distance, and the model fitted to it.
std::string VariogramText(const DepthComparison& truth) {
  std::string distances, values;
  for (const VariogramBin& bin : truth.variogram) {
    distances += fmt::format(" {:5.0f}", bin.distance_mm);
    values += fmt::format(" {:5.1f}", bin.semivariance_mm2);
  }
  const VariogramModel& model = truth.variogram_model;
  return distances.empty()
             ? ""
             : fmt::format(
                   "variogram of the true depth, mm {}\n                           mm²  {}\n"
                   "  fitted: {:.1f} + {:.1f} (1 - exp(-h / {:.0f} mm)) mm²\n",
                   distances, values, model.nugget_mm2, model.sill_mm2, model.length_mm);
}

std::string SharesText(const DepthField& depth) {
  std::string text;
  for (const SchemeShare& share : depth.shares) {
    text +=
        fmt::format("{}{} {:.2f}", text.empty() ? "weights: " : ", ", share.scheme, share.weight);
  }
  return text.empty() ? "" : text + "\n";
}

// Writes the parameters of the random process that kriging assumed.
std::string ProcessText(const DepthField& depth) {
  if (!depth.process) {
    return "";
  }
  std::string text =
      fmt::format("process: mean {:.1f} mm, sd {:.1f} mm, length {:.0f} mm, nugget {:.2f} mm\n",
                  depth.process->mean_mm, depth.process->signal_mm, depth.process->length_mm,
                  depth.process->nugget_mm);
  for (const std::string& words : depth.process->at_end) {
    text += fmt::format("  {}: the dowels do not determine it\n", words);
  }
  return text;
}

std::string ScoresLine(const std::string& what, const DepthScores& s) {
  return s.stated == 0
             ? ""
             : fmt::format(
                   "{:<26} {:6} {:6.2f} {:6.2f} {:7.2f} {:9.2f} {:4.0f} {:4.0f} "
                   "{:4.0f} %\n",
                   what, s.stated, s.mean_sd_mm, s.crps_mm, s.log_score, s.interval_score_90_mm,
                   100 * s.coverage_50, 100 * s.coverage_90, 100 * s.coverage_95);
}

// Writes the scores of the stated standard deviations.
std::string ScoresText(const DepthResult& result) {
  std::string lines;
  if (result.truth) {
    const DepthErrors& errors = result.truth->along_direction;
    lines += ScoresLine("  true depth, all scored", errors.scores) +
             ScoresLine("  true depth, by the scheme", errors.scheme_scores);
  }
  for (const auto& [kind, left_out] : result.left_out) {
    lines += ScoresLine(fmt::format("  {} left out", kind), left_out.scores);
  }
  return lines.empty() ? ""
                       : "stated sd                  points     sd   CRPS     log  interval within "
                         "50,  90,  95 %\n" +
                             lines;
}

std::string DepthPly(const DepthResult& result) {
  const DepthField& depth = result.depth;
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

// Writes the triangles of the shell whose three corners have a depth, moved by that depth (thesis
// 2.2: the soft tissue is at p + depth * direction).
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

std::vector<std::string> DepthResult::Faults() const {
  std::vector<std::string> faults;
  if (std::ranges::none_of(stage->depth.depth_mm, [](double d) { return std::isfinite(d); })) {
    faults.emplace_back("no vertex of the skull has a depth");
  }
  if (truth && !std::isfinite(truth->tips.rms_mm)) {
    faults.emplace_back("the distance of the depth's end from the true skin is not a number");
  }
  return faults;
}

DepthResult MeasureDepth(const Experiment& experiment, const RunContext& context,
                         StageCache* cache) {
  StepClock step(context);
  StageCache own_cache(4);
  DepthResult result;
  result.stage = MakeDepthStage(experiment, cache ? *cache : own_cache, step, context);
  const DepthStage& stage = *result.stage;
  result.depth = stage.depth;
  if (!std::holds_alternative<DepthMap>(experiment.interp)) {  // a map does not use dowels
    result.left_out =
        step("leave dowels out", [&] { return LeaveOut(experiment, stage, context); });
  }
  if (!result.left_out.empty()) {
    result.depth = WithStatedSd(std::move(result.depth), result.left_out.front().second,
                                stage.Input(), context);
  }
  if (stage.subject.skin) {
    result.truth = step("compare with the truth",
                        [&] { return CompareDepths(experiment, stage, result.depth, context); });
  }
  result.directions = result.truth ? result.truth->directions
                                   : DepthDirections(experiment.direction, stage.Input(), context);
  result.times = step.Take();
  return result;
}

Json DepthResultJson(const Experiment& experiment, const DepthResult& result) {
  Json json = {{"title", experiment.title},
               {"subject", result.stage->subject.name},
               {"usable", result.usable()},
               {"faults", result.Faults()},
               {"depth", DepthToJson(result.depth, result.stage->subject)},
               {"depth_truth", nullptr},
               {"cross_validation", Json::object()}};
  if (result.truth) {
    json["depth_truth"] = ComparisonToJson(*result.truth);
  }
  for (const auto& [kind, left_out] : result.left_out) {
    json["cross_validation"][kind] = CrossValidationToJson(left_out);
  }
  json["notes"] = result.stage->subject.notes;
  return json;
}

std::string LeftOutCsv(const DepthResult& result) {
  CsvWriter csv({"kind", "site", "landmark", "region", "depth_mm", "predicted_mm", "error_mm",
                 "sd_mm", "within_90", "status"});
  for (const auto& [kind, left_out] : result.left_out) {
    for (const LeftOut& out : left_out.left_out) {
      const char* const part = IsStandardSite(out.site) ? kFaceParts[FacePartOfSite(out.site)] : "";
      csv.Row(kind, out.site, WithoutSide(out.site), part, out.depth_mm, out.predicted_mm,
              out.error_mm, out.sd_mm, out.within_90, StatusWord(out.status));
    }
  }
  return csv.Text();
}

std::string DepthDowelsCsv(const DepthResult& result) {
  CsvWriter csv({"site", "base_x_mm", "base_y_mm", "base_z_mm", "direction_x", "direction_y",
                 "direction_z", "depth_mm", "sd_mm", "tip_x_mm", "tip_y_mm", "tip_z_mm", "role"});
  for (const Dowel& d : result.stage->subject.dowels_on_bone) {
    const Vec3 tip = d.Tip();
    csv.Row(d.site, d.base.x(), d.base.y(), d.base.z(), d.direction.x(), d.direction.y(),
            d.direction.z(), d.depth_mm, d.sd_mm, tip.x(), tip.y(), tip.z(), RoleName(d));
  }
  return csv.Text();
}

std::string DepthText(const DepthResult& result) {
  std::string text = SharesText(result.depth) + ProcessText(result.depth);
  if (result.truth) {
    text += TruthText(*result.truth) + VariogramText(*result.truth);
  }
  if (!result.left_out.empty()) {
    text += "dowels left out                  RMS   mean    max  signed  predicted  within 90 %\n";
  }
  for (const auto& [kind, left_out] : result.left_out) {
    text += fmt::format("  {:<24} {:6.2f} {:6.2f} {:6.2f} {:7.2f} {:4} of {:3}  {}\n", kind,
                        left_out.rms_mm, left_out.mean_absolute_mm, left_out.most_mm,
                        left_out.mean_mm, left_out.predicted, left_out.left_out.size(),
                        std::isfinite(left_out.coverage_90)
                            ? fmt::format("{:.0f} %", 100 * left_out.coverage_90)
                            : "no sd stated");
  }
  return text + ScoresText(result);
}

std::vector<Legend> DepthPictureLegends(bool has_truth) {
  constexpr double kMaxDepth_mm = 25, kMaxError_mm = 4;  // ends of the colour scales
  std::vector<Legend> legends = {{SequentialMap(0, kMaxDepth_mm), "interpolated tissue depth"}};
  if (has_truth) {
    legends.push_back({DivergingMap(kMaxError_mm), "too deep (+) or not deep enough (-)"});
  }
  return legends;
}

std::string DepthPicture(const DepthResult& result, int threads) {
  constexpr std::array kViews = {View::kFront, View::kThreeQuarter};
  const RenderOptions options{.width = 420, .height = 480, .lighting = Lighting::kEven};
  const TriMesh& shell = result.stage->shell;
  const std::vector<Legend> legends = DepthPictureLegends(result.truth.has_value());
  const auto sheet = [&](std::span<const double> values_mm, const ColourMap& map) {
    return RenderViews({{MappedObject(shell, values_mm, map)}}, Bounds(shell), kViews, options,
                       threads);
  };
  std::vector<Image> sheets = {sheet(result.stage->depth.depth_mm, legends[0].map)};
  if (result.truth) {
    sheets.push_back(sheet(result.truth->along_direction.error_mm, legends[1].map));
  }
  return EncodePng(ContactSheet(sheets));
}

void WriteDepth(const Experiment& experiment, const DepthResult& result, OutputFolder& folder,
                const RunContext& context) {
  folder.Write("resolved.yaml", WriteConfig(experiment));
  folder.Write("result.json", WithPlainTexts(DepthResultJson(experiment, result)).dump(2) + "\n");
  folder.Write("dowels.csv", DepthDowelsCsv(result));
  folder.Write("left_out.csv", LeftOutCsv(result));
  folder.Write("depth.ply", DepthPly(result));
  folder.Write("tips.ply", TipsPly(result));
  folder.Write("depth.png", DepthPicture(result, context.threads));
  folder.Write("timing.json", TimingJson(result.times));
}

}  // namespace semblance::problems
