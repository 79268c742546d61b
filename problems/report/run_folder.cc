// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/run_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "problems/config/terminal_text.h"
#include "problems/experiment/experiment_config.h"
#include "problems/experiment/input_contents.h"
#include "problems/experiment/metrics/face_metrics.h"
#include "problems/experiment/step_clock.h"
#include "problems/face/bust/bust_files.h"
#include "problems/io/manifest.h"
#include "problems/report/result_json.h"
#include "problems/report/run_pictures.h"
#include "problems/report/run_report.h"
#include "problems/report/scene_json.h"
#include "problems/report/section_pictures.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/parallel.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;

// The index of a site's dowel in the fit's target. -1 if it is not fitted.
int TargetIndex(const FitTarget& target, const std::string& site) {
  const auto found = std::find_if(target.points.begin(), target.points.end(),
                                  [&](const FitPoint& p) { return p.label == site; });
  return found == target.points.end() ? -1 : static_cast<int>(found - target.points.begin());
}

std::string DowelsCsv(const RunResult& result) {
  CsvWriter csv({"site", "base_x_mm", "base_y_mm", "base_z_mm", "direction_x", "direction_y",
                 "direction_z", "depth_mm", "sd_mm", "tip_x_mm", "tip_y_mm", "tip_z_mm", "u", "v",
                 "fit_residual_mm", "role", "turned_deg"});
  for (const Dowel& d : result.subject.dowels_on_bone) {
    const int index = TargetIndex(result.target, d.site);
    const Vec2 uv = index < 0 ? Vec2(kNaN, kNaN) : result.fit.uv[index];
    const Vec3 tip = d.Tip();
    const auto turn = result.subject.turns_deg.find(d.site);
    csv.Row(d.site, d.base.x(), d.base.y(), d.base.z(), d.direction.x(), d.direction.y(),
            d.direction.z(), d.depth_mm, d.sd_mm, tip.x(), tip.y(), tip.z(), uv.x(), uv.y(),
            index < 0 ? kNaN : result.fit.residual_mm[index], RoleName(d),
            turn == result.subject.turns_deg.end() ? kNaN : turn->second);
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

// A mesh with one value per vertex: as colours, as `quality` for MeshLab, and as `scalar_...` for
// CloudCompare and Blender.
std::string MappedPly(const TriMesh& mesh, const std::string& scalar,
                      const std::vector<double>& values, const ColourMap& map,
                      const std::vector<VertexScalar>& more = {}) {
  MeshAttributes attributes;
  attributes.colors = Bytes(ColoursAt(map, values));
  attributes.scalars = {{"quality", values}, {scalar, values}};
  attributes.scalars.insert(attributes.scalars.end(), more.begin(), more.end());
  return EncodeMesh(mesh, ".ply", attributes);
}

// A reconstructed mesh with the signed distance of each vertex to the true skin, or the distance to
// the skull if the skin is not known. `more` holds further values of each vertex.
std::string ReconstructionPly(const TriMesh& mesh, const RunResult& result,
                              const std::vector<VertexScalar>& more, const RunContext& context) {
  if (!result.truth) {
    std::vector<double> gap(mesh.points.size());
    const MeshQuery skull(result.shell);
    ParallelFor(gap.size(), context.threads, 256,
                [&](std::size_t v) { gap[v] = skull.Closest(mesh.points[v]).distance_mm; });
    return MappedPly(mesh, "scalar_depth_mm", gap, DepthColours(), more);
  }
  return MappedPly(mesh, "scalar_error_mm", SignedErrors(mesh, result, context), ErrorColours(),
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

// The origin of the bone under each vertex: 0 observed, 1 mirrored, 2 inferred.
VertexScalar OriginScalar(const TriMesh& mesh, const RunResult& result, const RunContext& context) {
  VertexScalar scalar{"scalar_origin", {}};
  for (const BoneOrigin origin : OriginUnder(mesh, result.shell, result.origin, context.threads)) {
    scalar.values.push_back(static_cast<double>(origin));
  }
  return scalar;
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

// The inputs by their hashes, and the versions of program and libraries.
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
  std::set<std::filesystem::path> known;  // an input may be a part of another one
  for (const std::filesystem::path& input : result.subject.inputs) {
    for (const std::filesystem::path& part : ListParts({.option = "", .file = input})) {
      if (known.insert(part).second) {
        json["inputs"].push_back(
            {{"file", part.filename().string()}, {"sha256", Sha256OfFile(part)}});
      }
    }
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

void WriteRun(const Experiment& experiment, const RunResult& result, OutputFolder& folder,
              const RunContext& context) {
  StepClock step(context, result.times);
  std::filesystem::remove(folder.Root() / "manifest.json");  // left by an earlier run
  step("write tables and meshes", [&] {
    folder.Write("resolved.yaml", WriteConfig(experiment));
    folder.Write("result.json", WithPlainTexts(ResultJson(experiment, result)).dump(2) + "\n");
    folder.Write("dowels.csv", DowelsCsv(result));
    folder.Write("seeds.csv", SeedsCsv(result));
    WriteMeshes(result, folder, context);
  });
  const Json provenance = step("hash inputs", [&] { return Provenance(experiment, result); });
  folder.Write("provenance.json", provenance.dump(2) + "\n");
  if (experiment.report) {
    step("write pictures", [&] {
      WritePictures(result, folder, context);
      WriteSections(result, folder);
    });
    step("write 3-D view", [&] { folder.Write("scene.json", SceneJson(result, context)); });
    step("write report", [&] { WriteReport(folder); });
  }
  folder.Write("timing.json", TimingJson(step.Take()));
  folder.Write("manifest.json", ManifestJson(provenance, folder));
}

}  // namespace semblance::problems
