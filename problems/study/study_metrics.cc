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

#include "problems/config/number_expression.h"
#include "problems/config/spelling_suggestion.h"
#include "problems/experiment/metrics/face_region.h"
#include "problems/report/result_json.h"
#include "problems/report/run_folder.h"
#include "problems/study/depth_study.h"
#include "problems/study/identify_study.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

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

// The complaint about one number.
std::string ComplaintAboutNumber(const std::string& metric, const std::set<std::string>& names,
                                 StudyJob job) {
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

// Returns true if the text has a sign of an expression. A path of result.json has none of them,
// except in a name that a user chose.
bool HasOperation(const std::string& metric) {
  return metric.find_first_of("+-*/(") != metric.npos;
}

// The metric as an expression; null if it is none.
std::unique_ptr<const NumberExpression> ReadExpression(const std::string& metric) {
  if (!HasOperation(metric)) {
    return nullptr;
  }
  try {
    auto expression = std::make_unique<const NumberExpression>(metric);
    return expression->IsName() ? nullptr : std::move(expression);
  } catch (const InputError&) {
    return nullptr;
  }
}

// The unit that the last part of a path ends in.
std::string_view UnitOf(const std::string& metric) {
  constexpr auto kUnits =
      std::to_array<std::pair<std::string_view, std::string_view>>({{"_mm", "mm"},
                                                                    {"_mm2", "mm²"},
                                                                    {"_cm2", "cm²"},
                                                                    {"_cm3", "cm³"},
                                                                    {"_deg", "deg"},
                                                                    {"_s", "s"}});
  for (const char* const share : {".within_", "coverage", ".shares."}) {
    if (metric.find(share) != metric.npos) {
      return "share";
    }
  }
  const auto found =
      std::ranges::find_if(kUnits, [&](const auto& unit) { return metric.ends_with(unit.first); });
  return found == kUnits.end() ? std::string_view("number") : found->second;
}

}  // namespace

std::string ComplaintAboutMetric(const std::string& metric, StudyJob job,
                                 std::span<const OwnMetric> own) {
  std::set<std::string> names = ListMetrics(job);
  for (const OwnMetric& each : own) {
    names.insert(each.name);
  }
  std::string complaint = ComplaintAboutNumber(metric, names, job);
  if (complaint.empty() || !HasOperation(metric)) {
    return complaint;
  }
  try {
    const NumberExpression expression(metric);
    for (const std::string& name : expression.names()) {
      if (std::string fault = ComplaintAboutNumber(name, names, job); !fault.empty()) {
        return fault;
      }
    }
    return "";
  } catch (const InputError& error) {
    return error.what();
  }
}

void CheckMetricNames(std::span<const OwnMetric> own, StudyJob job) {
  std::set<std::string> taken;
  const Json members = EmptyResultJson(job);
  for (const auto& [name, value] : members.items()) {
    taken.insert(name);
  }
  for (const OwnMetric& metric : own) {
    RequirePlainWord(metric.name, "metric");
    if (!taken.insert(metric.name).second) {
      throw InputError(fmt::format("metric '{}': the name is taken; choose another", metric.name));
    }
  }
}

std::string MetricsText(StudyJob job) {
  std::string text;
  for (const std::string& name : ListMetrics(job)) {
    text += fmt::format("{:<64} {}\n", name, UnitOf(name));
  }
  return text;
}

bool IsExpression(const std::string& metric) { return ReadExpression(metric) != nullptr; }

double ComputeMetric(const NamedNumbers& numbers, const std::string& metric) {
  const auto number = [&](const std::string& name) {
    const auto found = numbers.find(name);
    return found == numbers.end() ? kNaN : found->second;
  };
  if (numbers.contains(metric)) {
    return number(metric);
  }
  const std::unique_ptr<const NumberExpression> expression = ReadExpression(metric);
  return expression ? expression->Value(number) : kNaN;
}

std::vector<std::string> ListOperands(const std::string& metric) {
  const std::unique_ptr<const NumberExpression> expression = ReadExpression(metric);
  return expression ? expression->names() : std::vector{metric};
}

bool NeedsTrueSkin(const std::string& metric) {
  constexpr std::array kParts = {"face.", "implicit_face.", "depth_truth.", "identify.",
                                 "uncertainty.coverage"};
  const auto needs = [&](const std::string& name) {
    return std::ranges::any_of(kParts, [&](const char* part) { return name.starts_with(part); });
  };
  const std::unique_ptr<const NumberExpression> expression = ReadExpression(metric);
  return expression ? std::ranges::any_of(expression->names(), needs) : needs(metric);
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
  return IsExpression(metric)                      ? Better::kLower
         : LastPart(metric).starts_with("within_") ? Better::kHigher
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
          .target = IsExpression(metric) ? 0 : StatedShare(metric).value_or(0)};
}

}  // namespace semblance::problems
