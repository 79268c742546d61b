// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/result_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "fitting/problem/seeding.h"
#include "fitting/relaxation/dowel_mesh.h"
#include "problems/subject/sites.h"
#include "surfaces/base/quantile.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;

int CountStatus(const DepthField& field, DepthStatus status) {
  return static_cast<int>(std::count(field.status.begin(), field.status.end(), status));
}

Json ErrorsToJson(const DepthErrors& errors) {
  Json json = SummaryToJson(errors.all);
  json["coverage_90"] = errors.coverage_90;
  json["coverage"] = errors.coverage;
  json["scores"] = {{"all", ScoresToJson(errors.scores)},
                    {"scheme", ScoresToJson(errors.scheme_scores)}};
  const auto count = [&](TruthStatus status) {
    const auto it = errors.vertices.find(status);
    return it == errors.vertices.end() ? 0 : it->second;
  };
  json["vertices"] = {
      {"valid", count(TruthStatus::kValid)},     {"no_direction", count(TruthStatus::kNoDirection)},
      {"no_hit", count(TruthStatus::kNoHit)},    {"too_far", count(TruthStatus::kTooFar)},
      {"grazing", count(TruthStatus::kGrazing)}, {"behind", count(TruthStatus::kBehind)}};
  json["regions"] = Json::object();
  for (const auto& [name, summary] : errors.regions) {
    json["regions"][name] = SummaryToJson(summary);
    json["regions"][name]["scores"] = ScoresToJson(errors.region_scores.at(name));
  }
  return json;
}

// The scores of one part of the face, including predictions by the outside rule.
DepthScores ScoresIn(const std::string& part, const CrossValidation& result) {
  std::vector<double> errors_mm, sds_mm;
  for (const LeftOut& out : result.left_out) {
    // A dowel that is not at a standard site belongs to no part.
    if (IsStandardSite(out.site) && kFaceParts[FacePartOfSite(out.site)] == part) {
      errors_mm.push_back(out.error_mm);
      sds_mm.push_back(out.sd_mm);
    }
  }
  return ScoreDepths(errors_mm, sds_mm);
}

Json RegionsToJson(const CrossValidation& result) {
  Json json = Json::object();
  for (const std::string part : kFaceParts) {
    if (const DepthScores scores = ScoresIn(part, result); scores.points > 0) {
      json[part] = {{"n", scores.points},
                    {"rms_mm", scores.rmse_mm},
                    {"mean_abs_mm", scores.mae_mm},
                    {"scores", ScoresToJson(scores)}};
    }
  }
  return json;
}

Json VariogramToJson(const DepthComparison& comparison) {
  const VariogramModel& model = comparison.variogram_model;
  Json json = {{"nugget_mm2", model.nugget_mm2},
               {"sill_mm2", model.sill_mm2},
               {"length_mm", model.length_mm},
               {"bins", Json::array()}};
  for (const VariogramBin& bin : comparison.variogram) {
    json["bins"].push_back({{"distance_mm", bin.distance_mm},
                            {"semivariance_mm2", bin.semivariance_mm2},
                            {"pairs", bin.pairs}});
  }
  return json;
}

Json BoundsToJson(std::span<const BoundEffect> effects) {
  Json json = Json::array();
  for (const BoundEffect& effect : effects) {
    json.push_back({{"holds", effect.name},
                    {"least_mm", effect.least_mm ? Json(*effect.least_mm) : Json(nullptr)},
                    {"most_mm", effect.most_mm ? Json(*effect.most_mm) : Json(nullptr)},
                    {"moved_dowels", effect.dowels},
                    {"bone_cm2", effect.bone_cm2},
                    {"moved_share", effect.moved_share},
                    {"largest_move_mm", effect.largest_move_mm}});
  }
  return json;
}

}  // namespace

Json ScoresToJson(const DepthScores& s) {
  return {{"n", s.points},
          {"stated", s.stated},
          {"certain", s.certain},
          {"mae_mm", s.mae_mm},
          {"rmse_mm", s.rmse_mm},
          {"bias_mm", s.bias_mm},
          {"crps_mm", s.crps_mm},
          {"log_score", s.log_score},
          {"interval_score_90_mm", s.interval_score_90_mm},
          {"coverage_50", s.coverage_50},
          {"coverage_90", s.coverage_90},
          {"coverage_95", s.coverage_95},
          {"mean_sd_mm", s.mean_sd_mm},
          {"pit", s.pit}};
}

Json DepthToJson(const DepthField& depth, const Case& subject) {
  std::vector<double> assigned;
  for (std::size_t v = 0; v < depth.depth_mm.size(); ++v) {
    if (depth.status[v] == DepthStatus::kAssigned) {
      assigned.push_back(depth.depth_mm[v]);
    }
  }
  Json json = {{"vertices", depth.depth_mm.size()},
               {"assigned", CountStatus(depth, DepthStatus::kAssigned)},
               {"outside", CountStatus(depth, DepthStatus::kOutside)},
               {"not_facing", CountStatus(depth, DepthStatus::kNotFacing)},
               {"min_mm", nullptr},
               {"mean_mm", nullptr},
               {"max_mm", nullptr},
               {"dowels", subject.dowels_on_bone.size()},
               {"areas", subject.network.areas.size()}};
  if (depth.process) {
    json["process"] = {{"length_mm", depth.process->length_mm},
                       {"signal_mm", depth.process->signal_mm},
                       {"nugget_mm", depth.process->nugget_mm},
                       {"mean_mm", depth.process->mean_mm}};
  }
  if (!subject.bounds.empty()) {
    json["bounds"] = BoundsToJson(subject.bounds);
  }
  for (const SchemeShare& share : depth.shares) {
    json["shares"][share.scheme] = share.weight;
  }
  if (!assigned.empty()) {
    json["min_mm"] = *std::min_element(assigned.begin(), assigned.end());
    json["mean_mm"] = ArithmeticMean(assigned);
    json["max_mm"] = *std::max_element(assigned.begin(), assigned.end());
  }
  return json;
}

Json ComparisonToJson(const DepthComparison& comparison) {
  return {{"along_direction", ErrorsToJson(comparison.along_direction)},
          {"closest", ErrorsToJson(comparison.closest)},
          {"variogram", VariogramToJson(comparison)},
          {"tips", SummaryToJson(comparison.tips)}};
}

Json CrossValidationToJson(const CrossValidation& result) {
  Json json = {
      {"n", result.left_out.size()},
      {"predicted", result.predicted},
      {"rms_mm", result.rms_mm},
      {"mean_signed_mm", result.mean_mm},
      {"mean_abs_mm", result.mean_absolute_mm},
      {"max_mm", result.most_mm},
      {"coverage_90", result.coverage_90},
      {"coverage", result.coverage},
      {"own_sd", result.own_sd},
      {"scores",
       {{"all", ScoresToJson(result.scores_with_rule)}, {"scheme", ScoresToJson(result.scores)}}},
      {"regions", RegionsToJson(result)},
      {"sites", Json::object()}};
  for (const LeftOut& out : result.left_out) {
    json["sites"][out.site] = out.error_mm;
  }
  return json;
}

// ---------------------------------------------------------------------------------------------
// The fit
// ---------------------------------------------------------------------------------------------

namespace {

// Null for a negative value, which stands for "not counted".
Json Count(int value) { return value < 0 ? Json(nullptr) : Json(value); }

Json LevelJson(const LevelSummary& level) {
  Json json = {{"level", level.level},
               {"fraction", level.fraction},
               {"rms_before_mm", level.rms_before_mm},
               {"rms_after_mm", level.rms_after_mm},
               {"max_move_mm", level.max_move_mm},
               {"free_vertices", level.free_vertices},
               {"moved_vertices", Count(level.moved_vertices)},
               {"uncovered_vertices", Count(level.uncovered_vertices)},
               {"patches", Count(level.coverage.patches)},
               {"empty_patches", Count(level.coverage.empty_patches)},
               {"median_patch_points", level.coverage.median_patch_points},
               {"auto_weight", level.auto_weight},
               {"hold", level.hold},
               {"rank", Count(level.rank)},
               {"solver", level.solver},
               {"iterations", level.iterations},
               {"usable", level.usable},
               {"terms", Json::array()}};
  for (const TermCosts& term : level.terms) {
    json["terms"].push_back({{"term", term.term}, {"before", term.before}, {"after", term.after}});
  }
  return json;
}

Json RelaxationJson(const RelaxationSummary& step) {
  const auto penalties = [](const RelaxationPenalties& p) -> Json {
    return {{"distance", p.distance},
            {"bunching", p.bunching},
            {"distortion", p.distortion},
            {"crease", p.crease},
            {"standard", p.standard}};
  };
  return {{"before", penalties(step.before)},
          {"after", penalties(step.after)},
          {"max_move_mm", step.max_move_mm},
          {"flips_prevented", step.flips_prevented},
          {"steps_shortened", step.steps_shortened}};
}

}  // namespace

Json StepsToJson(const FitResult& fit) {
  Json json = {{"levels", Json::array()}};
  for (const LevelSummary& level : fit.levels) {
    json["levels"].push_back(LevelJson(level));
  }
  for (const RelaxationSummary& step : fit.relaxations) {
    json["relaxations"].push_back(RelaxationJson(step));
  }
  return json;
}

std::string RoleName(const Dowel& dowel) {
  return dowel.role == PointRole::kInserted ? "inserted" : "landmark";
}

std::string TimingJson(const std::vector<StepTime>& times) {
  Json json = {{"total_wall_s", 0}, {"cpu_s", 0}, {"steps", Json::array()}};
  double wall_s = 0, cpu_s = 0;
  for (const StepTime& time : times) {
    json["steps"].push_back({{"step", time.step},
                             {"wall_s", time.wall_s},
                             {"cpu_s", time.cpu_s},
                             {"peak_mb", time.peak_mb}});
    wall_s += time.wall_s;
    cpu_s += time.cpu_s;
  }
  json["total_wall_s"] = wall_s;
  json["cpu_s"] = cpu_s;
  return json.dump(2) + "\n";
}

// ---------------------------------------------------------------------------------------------
// The whole run
// ---------------------------------------------------------------------------------------------

namespace {

Json ImplicitJson(const ImplicitFace& face) {
  return {{"cell_mm", face.cell_mm},
          {"emitters", face.emitters},
          {"emitters_per_square_depth", face.emitters_per_square_depth},
          {"triangles_dense", face.dense.triangles.size()},
          {"triangles", face.mesh.triangles.size()},
          {"decimation_error_mm", face.decimation.error_mm},
          {"decimation_ended_by", EnumNames(face.decimation.stop)[int(face.decimation.stop)]},
          {"dropped_components", face.dropped_components},
          {"crossed_cells", face.counts.active_cells},
          {"corner_evaluations", face.counts.corner_evaluations},
          {"edge_evaluations", face.counts.edge_evaluations},
          {"emitter_evaluations", face.counts.emitter_evaluations},
          {"bound_evaluations", face.counts.bound_evaluations}};
}

// Adds the state of the network of dowels and seeds in (u,v), which relaxation must not fold.
void AddNetwork(const RunResult& result, Json& json) {
  std::vector<Vec2> uv;
  for (const FitPoint& p : result.target.points) {
    uv.push_back(p.uv);
  }
  const DowelMesh mesh(result.placed.surface, uv);
  int prevented = 0;
  for (const RelaxationSummary& step : result.fit.relaxations) {
    prevented += step.flips_prevented;
  }
  json["sharpest_crease_deg"] = SharpestCrease_deg(result.fit.surface, mesh, result.fit.uv);
  json["flips"] = mesh.Flips(result.fit.uv);
  json["flips_prevented"] = prevented;
}

Json FitJson(const RunResult& result) {
  Json json = {{"dowel_rms_mm", result.fit.dowel_rms_mm},
               {"dowel_closest_rms_mm", MarkerRms_mm(result)},
               {"point_rms_mm", result.fit.point_rms_mm},
               {"points", result.target.points.size()},
               {"seeds", result.seeding.points.size()},
               {"seeds_masked", result.seeding.masked},
               {"seeds_missed", result.seeding.missed},
               {"seeds_folded", result.seeding.folded},
               {"template_scale", result.face_from_template.scale},
               {"restored_features", result.fit.restored_features},
               {"feature_distortion", FeaturesToJson(result.features)},
               {"usable", result.fit.usable}};
  AddNetwork(result, json);
  json.update(StepsToJson(result.fit));
  return json;
}

Json UncertaintyJson(const RunResult& result) {
  if (!result.uncertainty) {
    return nullptr;
  }
  const FaceUncertainty& u = *result.uncertainty;
  Json json = {{"sigma_median_mm", u.median_mm},
               {"sigma_p95_mm", u.p95_mm},
               {"prior_sd", u.prior_sd},
               {"depth_length_mm", u.depth_length_mm},
               {"depth_signal_mm", u.depth_signal_mm},
               {"samples", u.samples.size()},
               {"terms_left_out", u.left_out}};
  json["coverage_90"] = result.truth ? Json(result.truth->sigma.at_90) : Json(nullptr);
  json["coverage_90_of"] = result.truth ? Json(result.truth->sigma.of_part) : Json(nullptr);
  json["coverage_area_cm2"] = result.truth ? Json(result.truth->sigma.area_cm2) : Json(nullptr);
  json["coverage"] = result.truth ? Json(result.truth->sigma.curve) : Json(nullptr);
  json["scores"] = result.truth ? ScoresToJson(result.truth->sigma.scores) : Json(nullptr);
  return json;
}

// The fit of the face model to the dowels and the implicit face.
Json PriorJson(const ShapeEstimate& estimate, const std::optional<FaceUncertainty>& uncertainty) {
  const auto rms = [](auto&& values) {
    double sum = 0;
    for (const double value : values) {
      sum += value * value;
    }
    return std::sqrt(sum / static_cast<double>(std::size(values)));
  };
  // `joint` states sigma for its own face alone.
  const std::vector<double>& sigma_mm =
      estimate.sigma_mm.empty() && uncertainty ? uncertainty->sigma_mm : estimate.sigma_mm;
  Json dowel_weights = Json::object();
  for (std::size_t k = 0; k < estimate.tip_labels.size(); ++k) {
    dowel_weights[estimate.tip_labels[k]] = estimate.tip_weight[k];
  }
  return {{"coefficients",
           std::vector<double>(estimate.coefficients.begin(), estimate.coefficients.end())},
          {"coefficients_rms", rms(estimate.coefficients)},
          {"scale", estimate.subject_from_model.scale},
          {"field_rms_mm", estimate.field_rms_mm},
          {"sigma_rms_mm", rms(sigma_mm)},
          {"dowels", estimate.tip_residual_mm.size()},
          {"dowel_rms_mm", rms(estimate.tip_residual_mm)},
          {"dowel_weights", dowel_weights},
          {"surface_points", estimate.surface_points},
          {"rounds", estimate.rounds},
          {"last_move_mm", estimate.last_move_mm},
          {"usable", estimate.usable}};
}

Json BustJson(const Bust& bust) {
  return {{"scale", bust.subject_from_model.scale},
          {"on_face", bust.on_face},
          {"face_rms_mm", bust.face_rms_mm},
          {"on_skull", bust.on_skull},
          {"skull_rms_mm", bust.skull_rms_mm},
          {"turned_over", bust.turned_over},
          {"released", bust.released}};
}

// The applied rules with their residuals.
Json RulesJson(const std::vector<AppliedRule>& rules) {
  Json json = Json::array();
  for (const AppliedRule& rule : rules) {
    json.push_back({{"rule", rule.rule},
                    {"point", rule.point},
                    {"coordinate", rule.coordinate},
                    {"source", rule.source},
                    {"sd_mm", rule.sd_mm},
                    {"residual_mm", rule.residual_mm}});
  }
  return json;
}

Json BoneJson(const RunResult& result) {
  const auto area_cm2 = AreaByOrigin_cm2(result.shell, result.origin);
  Json json;
  for (std::size_t k = 0; k < area_cm2.size(); ++k) {
    json[fmt::format("{}_cm2", EnumNames(BoneOrigin{})[k])] = area_cm2[k];
  }
  return json;
}

}  // namespace

double MarkerRms_mm(const RunResult& result) {
  if (result.face.mesh.triangles.empty()) {
    return kNaN;  // no run yet: a study looks at the names of the metrics only
  }
  const MeshQuery face(result.face.mesh);
  double squares = 0;
  int count = 0;
  for (const Dowel& dowel : result.subject.dowels_on_bone) {
    if (std::isfinite(dowel.depth_mm)) {
      const double distance_mm = face.Closest(dowel.Tip()).distance_mm;
      squares += distance_mm * distance_mm;
      ++count;
    }
  }
  return count > 0 ? std::sqrt(squares / count) : kNaN;
}

Json RecordJson(const CaseRecord& record) {
  return {{"number", record.number}, {"age", record.age}, {"notes", record.notes}};
}

namespace {

// The choices for which `auto` and `default` stand in this run.
Json MethodJson(const Experiment& experiment) {
  const auto name = [](const auto& choice) {
    return std::visit([](const auto& chosen) { return chosen.kName; }, choice);
  };
  return {{"face", name(WayToFace(experiment))}, {"interp", name(WayToDepth(experiment))}};
}

}  // namespace

Json ResultJson(const Experiment& experiment, const RunResult& result) {
  Json json = {{"title", experiment.title},
               {"subject", result.subject.name},
               {"record", RecordJson(experiment.record)},
               {"method", MethodJson(experiment)},
               {"usable", result.usable()},
               {"faults", result.Faults()},
               {"plausibility", PlausibilityToJson(result.plausibility)}};
  json["face"] = result.truth
                     ? ScoreToJson(result.truth->face, result.truth->details, result.truth->skin)
                     : Json(nullptr);
  json["implicit_face"] = result.truth ? MetricsToJson(result.truth->implicit) : Json(nullptr);
  json["bone"] = BoneJson(result);
  json["depth"] = DepthToJson(result.depth, result.subject);
  json["depth_truth"] = result.truth ? ComparisonToJson(result.truth->depth) : Json(nullptr);
  json["implicit"] = ImplicitJson(result.implicit);
  json["fit"] = FitJson(result);
  if (result.prior) {
    json["prior"] = PriorJson(*result.prior, result.uncertainty);
    json["rules"] = RulesJson(result.rules);
  }
  if (result.bust) {
    json["bust"] = BustJson(*result.bust);
  }
  json["uncertainty"] = UncertaintyJson(result);
  json["notes"] = result.Notes();
  return json;
}

}  // namespace semblance::problems
