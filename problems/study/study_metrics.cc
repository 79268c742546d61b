// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "problems/config/spelling_suggestion.h"
#include "problems/metrics/face_region.h"
#include "problems/report/run_folder.h"
#include "problems/study/depth_study.h"
#include "problems/study/identify_study.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

// Null is a number that is not known.
void AddNames(const Json& json, const std::string& path, std::set<std::string>& names) {
  if (json.is_number() || json.is_null()) {
    names.insert(path);
  } else if (json.is_object()) {
    for (const auto& [key, value] : json.items()) {
      AddNames(value, path.empty() ? key : path + "." + key, names);
    }
  }
}

// The results are those of no run at all, with every part that may be there: what writes them
// names the numbers.
DepthComparison EmptyComparison() {
  DepthComparison comparison;
  for (DepthErrors* errors : {&comparison.along_direction, &comparison.closest}) {
    for (const char* part : kFaceParts) {
      errors->regions[part] = {};
      errors->region_scores[part] = {};
    }
  }
  return comparison;
}

FaceMetrics EmptyMetrics() {
  FaceMetrics metrics;
  for (const char* part : kFaceParts) {
    metrics.regions[part] = {};
  }
  return metrics;
}

// A square of 1 mm, for what cannot be without a surface.
HSplineSurface AnySurface() {
  const HSplineShape shape{.patches_u = 1, .patches_v = 1, .max_level = 0};
  ControlNet net{.columns = shape.Columns(0), .rows = shape.Rows(0), .vertices = {}};
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      net.vertices.emplace_back(i, j, 0);
    }
  }
  return {shape, net};
}

RunResult EmptyRun() {
  const HSplineSurface surface = AnySurface();
  RunResult result{.subject = {},
                   .shell = {},
                   .origin = {},
                   .depth = {},
                   .implicit = {},
                   .face_from_template = {},
                   .placed = {.surface = surface, .site_uv = {}, .features = {}},
                   .prior = ShapeEstimate{},
                   .rules = {},
                   .seeding = {},
                   .target = {},
                   .fit = {.surface = surface},
                   .before_edits = {},
                   .face = {},
                   .uncertainty = FaceUncertainty{},
                   .truth = TruthComparison{},
                   .features = {},
                   .bust_model = nullptr,
                   .bust = Bust{},
                   .times = {}};
  result.truth->face = result.truth->implicit = EmptyMetrics();
  result.truth->depth = EmptyComparison();
  return result;
}

DepthResult EmptyDepth() {
  DepthResult result;
  result.stage = std::make_shared<const DepthStage>();
  result.truth = EmptyComparison();
  for (const char* kind : {"landmark", "side", "k_fold"}) {
    result.left_out.emplace_back(kind, CrossValidation{});
  }
  return result;
}

Json EmptyResultJson(StudyJob job) {
  return job == StudyJob::kDepth  ? DepthResultJson(Experiment{}, EmptyDepth())
         : job == StudyJob::kFace ? ResultJson(Experiment{}, EmptyRun())
                                  : IdentifyResultJson(Experiment{}, {.run = EmptyRun()});
}

// What a subject has for each of its landmarks, features and regions.
bool IsOfOneSubject(const std::string& metric) {
  constexpr std::array kGroups = {".landmarks.", ".features.", ".sites.", ".feature_distortion.",
                                  ".coverage_90_of."};
  return std::ranges::any_of(
             kGroups, [&](const char* group) { return metric.find(group) != metric.npos; }) ||
         (metric.starts_with("cross_validation.") && metric.find(".regions.") != metric.npos);
}

}  // namespace

std::set<std::string> MetricsOf(StudyJob job) {
  std::set<std::string> names;
  AddNames(EmptyResultJson(job), "", names);
  return names;
}

std::string ComplaintAboutMetric(const std::string& metric, StudyJob job) {
  const std::set<std::string> names = MetricsOf(job);
  const auto group = metric.substr(0, metric.find('.')) + ".";
  const auto of_group = names.lower_bound(group);
  const bool has_group = of_group != names.end() && of_group->starts_with(group);
  if (names.contains(metric) || (has_group && IsOfOneSubject(metric))) {
    return "";
  }
  const std::vector<std::string> known(names.begin(), names.end());
  const std::string nearest = NearestWord(metric, known);
  return fmt::format(
      "no trial of job: {} has a number '{}'{}", EnumNames(job)[static_cast<int>(job)], metric,
      nearest.empty()
          ? "; result.json of a run shows them, e.g. " +
                std::string(job == StudyJob::kDepth ? "depth_truth.along_direction.rms_mm"
                                                    : "face.rms_mm")
          : fmt::format("; did you mean '{}'?", nearest));
}

bool NeedsTrueSkin(const std::string& metric) {
  constexpr std::array kParts = {"face.", "implicit_face.", "depth_truth.", "identify.",
                                 "uncertainty.coverage"};
  return std::ranges::any_of(kParts, [&](const char* part) { return metric.starts_with(part); });
}

Better BetterOf(const std::string& metric) {
  const std::size_t dot = metric.rfind('.');
  const std::string last = dot == metric.npos ? metric : metric.substr(dot + 1);
  return last.starts_with("within_") ? Better::kHigher : Better::kLower;
}

}  // namespace semblance
