// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>
#include <variant>
#include <vector>

#include "problems/config/spelling_suggestion.h"
#include "problems/experiment/metrics/face_region.h"
#include "problems/report/result_json.h"
#include "problems/report/run_folder.h"
#include "problems/study/depth_study.h"
#include "problems/study/identify_study.h"
#include "problems/subject/sites.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;

// Adds the paths of all numbers. Null stands for a number that is not known.
void AddNames(const Json& json, const std::string& path, std::set<std::string>& names) {
  if (json.is_number() || json.is_null()) {
    names.insert(path);
  } else if (json.is_object()) {
    for (const auto& [key, value] : json.items()) {
      AddNames(value, path.empty() ? key : path + "." + key, names);
    }
  }
}

// The names come from writing an empty result that has every optional part, so that they cannot
// differ from those of real results.
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

// A square of 1 mm, because a run result must have a surface.
HSplineSurface UnitSquare() {
  const HSplineShape shape{.patches_u = 1, .patches_v = 1, .max_level = 0};
  ControlNet net{.columns = shape.Columns(0), .rows = shape.Rows(0), .vertices = {}};
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      net.vertices.emplace_back(i, j, 0);
    }
  }
  return {shape, net};
}

template <class... Schemes>
std::vector<SchemeShare> SharesOfEach(const std::variant<Schemes...>&) {
  return {{std::string(Schemes::kName), kNaN}...};
}

// A depth field with the numbers of kriging (its process) and of an average of all schemes.
DepthField EmptyDepthOfAllKinds() {
  DepthField depth;
  depth.shares = SharesOfEach(SingleScheme());
  depth.process = DepthProcess{};
  return depth;
}

RunResult EmptyRun() {
  const HSplineSurface surface = UnitSquare();
  RunResult result{.subject = {},
                   .shell = {},
                   .origin = {},
                   .depth = EmptyDepthOfAllKinds(),
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
                   .plausibility = {},
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
  result.depth = EmptyDepthOfAllKinds();
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

// Lists the metrics of a job by dotted path, as in trials.csv. Metrics per landmark, feature and
// left-out site are not listed, because they depend on the subject.
std::set<std::string> ListMetrics(StudyJob job) {
  std::set<std::string> names;
  AddNames(EmptyResultJson(job), "", names);
  return names;
}

// Returns true if a name begins with `start`.
bool HasPrefix(const std::string& start, const std::set<std::string>& names) {
  const auto first = names.lower_bound(start);
  return first != names.end() && first->starts_with(start);
}

// Returns true for a metric per landmark, feature, site or region, in a group of metrics that the
// job has. Each subject has its own landmarks, features and sites.
bool DependsOnSubject(const std::string& metric, const std::set<std::string>& names) {
  constexpr std::array kGroups = {".landmarks.", ".features.", ".sites.", ".feature_distortion.",
                                  ".coverage_90_of."};
  const auto has = [&](const char* group) {
    const std::size_t at = metric.find(group);
    return at != metric.npos && HasPrefix(metric.substr(0, at + 1), names);
  };
  return std::ranges::any_of(kGroups, has) ||
         (metric.starts_with("cross_validation.") && has(".regions."));
}

// Returns true for "depth.shares.kriging matern_5_2": the share of a scheme with other options.
bool IsShareWithOptions(const std::string& metric, const std::set<std::string>& names) {
  const std::size_t blank = metric.find(' ');
  return metric.starts_with("depth.shares.") && blank != metric.npos && blank + 1 < metric.size() &&
         names.contains(metric.substr(0, blank));
}

// Complains about a paired site without its side. Other names are allowed, because an experiment
// can name its own dowels.
std::string StandardSiteFault(const std::string& metric) {
  constexpr std::string_view kGroup = ".sites.";
  const std::size_t at = metric.find(kGroup);
  const std::string site = at == metric.npos ? "" : metric.substr(at + kGroup.size());
  const auto is_site = [](const std::string& code) {
    return IsStandardSite(code) || IsFurtherSite(code);
  };
  return site.empty() || is_site(site) || !is_site(site + "_l")
             ? ""
             : fmt::format("no trial has a number '{}': '{}' is a paired site; write {}_l or {}_r",
                           metric, site, site, site);
}

}  // namespace

std::string ComplaintAboutMetric(const std::string& metric, StudyJob job) {
  const std::set<std::string> names = ListMetrics(job);
  if (names.contains(metric) || IsShareWithOptions(metric, names)) {
    return "";
  }
  if (DependsOnSubject(metric, names)) {
    return StandardSiteFault(metric);
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

namespace {

// The last part of a path.
std::string LastPart(const std::string& metric) {
  const std::size_t dot = metric.rfind('.');
  return dot == metric.npos ? metric : metric.substr(dot + 1);
}

// The share that a coverage should have, e.g. 0.9 for coverage_90 and coverage_90_of.nose. Nothing
// for other metrics.
std::optional<double> StatedShare(const std::string& metric) {
  for (const auto& [name, share] : std::to_array<std::pair<const char*, double>>(
           {{"coverage_50", 0.5}, {"coverage_90", 0.9}, {"coverage_95", 0.95}})) {
    if (LastPart(metric) == name || metric.find(fmt::format(".{}_of.", name)) != metric.npos) {
      return share;
    }
  }
  return std::nullopt;
}

// Returns true for errors with a sign: too thick or too thin.
bool IsSigned(const std::string& metric) {
  return LastPart(metric) == "mean_signed_mm" || LastPart(metric) == "bias_mm" ||
         (metric.starts_with("cross_validation.") && metric.find(".sites.") != metric.npos);
}

}  // namespace

Better DefaultBetter(const std::string& metric) {
  return LastPart(metric).starts_with("within_")   ? Better::kHigher
         : IsSigned(metric) || StatedShare(metric) ? Better::kNearest
                                                   : Better::kLower;
}

double Preference::RankingCost(double value) const {
  return better == Better::kHigher    ? -value
         : better == Better::kNearest ? std::abs(value - target)
                                      : value;
}

double Preference::Compared(double value) const {
  return better == Better::kNearest ? RankingCost(value) : value;
}

bool Preference::IsBetter(double compared, double than) const {
  return better == Better::kHigher ? compared > than : compared < than;
}

std::string Preference::ToPhrase() const {
  return better == Better::kHigher    ? "higher is better"
         : better == Better::kNearest ? fmt::format("nearest to {} is better", target)
                                      : "lower is better";
}

std::string Preference::TargetSuffix() const {
  return better == Better::kNearest ? fmt::format(", distance from {}", target) : "";
}

Preference PreferenceFor(const std::string& metric, std::optional<Better> given) {
  return {.better = given.value_or(DefaultBetter(metric)),
          .target = StatedShare(metric).value_or(0)};
}

}  // namespace semblance::problems
