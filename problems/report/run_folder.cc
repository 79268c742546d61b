// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/run_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "fitting/problem/seeding.h"
#include "fitting/relaxation/dowel_mesh.h"
#include "problems/bust/bust_files.h"
#include "problems/metrics/face_metrics.h"
#include "problems/output/manifest.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/report/depth_json.h"
#include "problems/report/fit_json.h"
#include "problems/report/run_pictures.h"
#include "problems/report/run_report.h"
#include "problems/report/scene_json.h"
#include "problems/report/timing_json.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/parallel.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

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

// What relaxation has to keep whole: the network of dowels and seeds in (u,v).
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

// What the prior made of the dowels and the implicit face.
Json PriorJson(const ShapeEstimate& estimate) {
  const auto rms = [](auto&& values) {
    double sum = 0;
    for (const double value : values) {
      sum += value * value;
    }
    return std::sqrt(sum / static_cast<double>(std::size(values)));
  };
  return {{"coefficients",
           std::vector<double>(estimate.coefficients.begin(), estimate.coefficients.end())},
          {"coefficients_rms", rms(estimate.coefficients)},
          {"scale", estimate.subject_from_model.scale},
          {"field_rms_mm", estimate.field_rms_mm},
          {"sigma_rms_mm", rms(estimate.sigma_mm)},
          {"dowels", estimate.tip_residual_mm.size()},
          {"dowel_rms_mm", rms(estimate.tip_residual_mm)},
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

// The rules that took part, each with what it left.
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

// Where a dowel stands in the fit's target; -1 if it is not fitted.
int TargetIndex(const FitTarget& target, const std::string& site) {
  const auto found = std::find_if(target.points.begin(), target.points.end(),
                                  [&](const FitPoint& p) { return p.label == site; });
  return found == target.points.end() ? -1 : static_cast<int>(found - target.points.begin());
}

std::string RoleOf(const Dowel& dowel) {
  return dowel.role == PointRole::kInserted ? "inserted" : "landmark";
}

std::string DowelsCsv(const RunResult& result) {
  CsvWriter csv({"site", "base_x_mm", "base_y_mm", "base_z_mm", "direction_x", "direction_y",
                 "direction_z", "depth_mm", "sd_mm", "tip_x_mm", "tip_y_mm", "tip_z_mm", "u", "v",
                 "fit_residual_mm", "role"});
  for (const Dowel& d : result.subject.dowels_on_bone) {
    const int index = TargetIndex(result.target, d.site);
    const Vec2 uv = index < 0 ? Vec2(kNaN, kNaN) : result.fit.uv[index];
    const Vec3 tip = d.Tip();
    csv.Row(d.site, d.base.x(), d.base.y(), d.base.z(), d.direction.x(), d.direction.y(),
            d.direction.z(), d.depth_mm, d.sd_mm, tip.x(), tip.y(), tip.z(), uv.x(), uv.y(),
            index < 0 ? kNaN : result.fit.residual_mm[index], RoleOf(d));
  }
  return csv.Text();
}

std::string SeedsCsv(const RunResult& result) {
  CsvWriter csv({"seed", "x_mm", "y_mm", "z_mm", "u", "v", "weight", "fit_residual_mm"});
  for (std::size_t k = 0; k < result.target.points.size(); ++k) {
    const FitPoint& p = result.target.points[k];
    if (p.role == PointRole::kSeed) {
      csv.Row(p.label, p.position.x(), p.position.y(), p.position.z(), result.fit.uv[k].x(),
              result.fit.uv[k].y(), p.weight, result.fit.residual_mm[k]);
    }
  }
  return csv.Text();
}

std::vector<std::array<std::uint8_t, 3>> Bytes(const std::vector<Colour>& colours) {
  std::vector<std::array<std::uint8_t, 3>> bytes;
  for (const Colour& c : colours) {
    const auto byte = [](double x) {
      return static_cast<std::uint8_t>(std::lround(255 * std::clamp(x, 0.0, 1.0)));
    };
    bytes.push_back({byte(c.r), byte(c.g), byte(c.b)});
  }
  return bytes;
}

// A mesh with one value per vertex: as colours for people's eyes, as `quality` for MeshLab, as
// `scalar_...` for CloudCompare and Blender.
std::string MappedPly(const TriMesh& mesh, const std::string& scalar,
                      const std::vector<double>& values, const ColourMap& map,
                      const std::vector<VertexScalar>& more = {}) {
  MeshAttributes attributes;
  attributes.colors = Bytes(ColoursAt(map, values));
  attributes.scalars = {{"quality", values}, {scalar, values}};
  attributes.scalars.insert(attributes.scalars.end(), more.begin(), more.end());
  return EncodeMesh(mesh, ".ply", attributes);
}

// How far each vertex of a reconstructed mesh lies outside the true skin; distance to the skull
// where the skin is not known. more: further values of each vertex.
std::string ReconstructionPly(const TriMesh& mesh, const RunResult& result,
                              const std::vector<VertexScalar>& more, const RunContext& context) {
  if (!result.truth) {
    std::vector<double> gap(mesh.points.size());
    const MeshQuery skull(result.shell);
    ParallelFor(gap.size(), context.threads, 256,
                [&](std::size_t v) { gap[v] = skull.Closest(mesh.points[v]).distance_mm; });
    return MappedPly(mesh, "scalar_depth_mm", gap, DepthColours(), more);
  }
  return MappedPly(mesh, "scalar_error_mm", SignedErrorOf(mesh, result, context), ErrorColours(),
                   more);
}

void WriteSamples(const FaceUncertainty& uncertainty, OutputFolder& folder) {
  constexpr int kQuadsPerPatch = 4;
  for (std::size_t k = 0; k < uncertainty.samples.size(); ++k) {
    Tessellation sample = Tessellate(uncertainty.samples[k], kQuadsPerPatch);
    folder.Write(fmt::format("sample_{}.ply", k),
                 EncodeMesh(sample.mesh, ".ply", {std::move(sample.normals), {}, {}}));
  }
}

// 0 observed, 1 mirrored, 2 inferred: of the bone under each vertex.
VertexScalar OriginScalar(const TriMesh& mesh, const RunResult& result, const RunContext& context) {
  VertexScalar scalar{"scalar_origin", {}};
  for (const BoneOrigin origin : OriginUnder(mesh, result.shell, result.origin, context.threads)) {
    scalar.values.push_back(static_cast<double>(origin));
  }
  return scalar;
}

Json BoneJson(const RunResult& result) {
  const auto area_cm2 = AreaByOrigin_cm2(result.shell, result.origin);
  Json json;
  for (std::size_t k = 0; k < area_cm2.size(); ++k) {
    json[fmt::format("{}_cm2", EnumNames(BoneOrigin{})[k])] = area_cm2[k];
  }
  return json;
}

void WriteMeshes(const RunResult& result, OutputFolder& folder, const RunContext& context) {
  folder.Write("face.hspline.json", HSplineToJson(result.fit.surface));
  std::vector<VertexScalar> more = {OriginScalar(result.face.mesh, result, context)};
  if (result.uncertainty && !result.uncertainty->sigma_mm.empty()) {
    more.push_back({"scalar_sigma_mm", result.uncertainty->sigma_mm});
  }
  folder.Write("face.ply", ReconstructionPly(result.face.mesh, result, more, context));
  folder.Write("implicit.ply",
               ReconstructionPly(result.implicit.mesh, result,
                                 {OriginScalar(result.implicit.mesh, result, context)}, context));
  if (result.uncertainty) {
    WriteSamples(*result.uncertainty, folder);
  }
  if (result.bust) {
    for (const NamedBytes& file : BustToFiles(*result.bust, *result.bust_model)) {
      folder.Write(file.name, file.bytes);
    }
  }
  folder.Write("depth.ply",
               MappedPly(result.shell, "scalar_depth_mm", result.depth.depth_mm, DepthColours(),
                         {OriginScalar(result.shell, result, context)}));
}

// What went in, and what it was made with.
Json Provenance(const Experiment& experiment, const RunResult& result) {
  Json json = {{"program", "semblance"},
               {"version", SEMBLANCE_VERSION},
               {"libraries", Json::object()},
               {"inputs", Json::array()}};
  if (const auto* phantom = std::get_if<PhantomOptions>(&experiment.subject)) {
    json["random_seed"] = phantom->random_seed;
  }
  for (const auto& [name, version] : LibraryVersions()) {
    json["libraries"][name] = version;
  }
  for (const std::filesystem::path& input : result.subject.inputs) {
    json["inputs"].push_back(
        {{"file", input.filename().string()}, {"sha256", Sha256OfFile(input)}});
  }
  return json;
}

std::string ManifestJson(Json provenance, const OutputFolder& folder) {
  std::vector<std::string> names = folder.Written();
  std::erase(names, "timing.json");  // differs from run to run
  std::sort(names.begin(), names.end());
  provenance["outputs"] = Json::array();
  for (const std::string& name : names) {
    provenance["outputs"].push_back(
        {{"file", name}, {"sha256", Sha256OfFile(folder.Root() / name)}});
  }
  return provenance.dump(2) + "\n";
}

}  // namespace

Json ResultJson(const Experiment& experiment, const RunResult& result) {
  Json json = {{"title", experiment.title},
               {"subject", result.subject.name},
               {"usable", result.usable()},
               {"faults", result.Faults()}};
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
    json["prior"] = PriorJson(*result.prior);
    json["rules"] = RulesJson(result.rules);
  }
  if (result.bust) {
    json["bust"] = BustJson(*result.bust);
  }
  json["uncertainty"] = UncertaintyJson(result);
  json["notes"] = result.Notes();
  return json;
}

void WriteRun(const Experiment& experiment, const RunResult& result, OutputFolder& folder,
              const RunContext& context) {
  context.Report("write");
  std::filesystem::remove(folder.Root() / "manifest.json");  // of a run that is written over
  folder.Write("resolved.yaml", WriteConfig(experiment));
  folder.Write("result.json", ResultJson(experiment, result).dump(2) + "\n");
  folder.Write("dowels.csv", DowelsCsv(result));
  folder.Write("seeds.csv", SeedsCsv(result));
  WriteMeshes(result, folder, context);
  WritePictures(result, folder, context);
  folder.Write("scene.json", SceneJson(result, context));
  const Json provenance = Provenance(experiment, result);
  folder.Write("provenance.json", provenance.dump(2) + "\n");
  WriteReport(folder);
  folder.Write("timing.json", TimingJson(result.times));
  folder.Write("manifest.json", ManifestJson(provenance, folder));
}

}  // namespace semblance
