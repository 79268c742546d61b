// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_json.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "problems/app/workbench/bench_config.h"
#include "problems/report/site_page.h"
#include "problems/report/view/view_mesh.h"
#include "problems/subject/average_skull.h"
#include "problems/subject/sites.h"
#include "surfaces/hspline_query/tessellate.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;  // writes NaN as null

Json LandmarkJson(const BenchLandmark& l, const LandmarkChecks& checks) {
  Json json = {{"site", l.site}, {"point", l.point},       {"certainty", EnumWord(l.certainty)},
               {"note", l.note}, {"proposed", l.proposed}, {"turned", l.normal.has_value()}};
  json["doubt_mm"] = l.doubt_mm ? Json(*l.doubt_mm) : Json();
  json["doubtful"] = l.IsDoubtful();
  json["depth_along_normal_mm"] = l.depth_along_normal_mm ? Json(*l.depth_along_normal_mm) : Json();
  if (const auto at = checks.sites.find(l.site); at != checks.sites.end()) {
    json["from_bone_mm"] = at->second.from_bone_mm;
    json["from_predicted_mm"] = at->second.from_predicted_mm;
    json["from_mirror_mm"] = at->second.from_mirror_mm;
  }
  return json;
}

Json SubjectJson(const Bench::Snapshot& shot) {
  const BenchSubject& subject = *shot.subject;
  const auto& files = std::get<FileSubject>(shot.experiment.subject);
  Json json = {{"name", CurrentState(shot.history).subject},
               {"revision", shot.subject_revision},
               {"skull", files.skull.string()},
               {"skin", files.skin.string()},
               {"triangles", subject.skull.mesh.triangles.size()},
               {"faults", subject.faults},
               {"notes", subject.notes}};
  if (!subject.skull.mesh.points.empty()) {
    const Box3 box = Bounds(subject.skull.mesh);
    json["size_mm"] = Vec3(box.sizes());
  }
  return json;
}

const char* JobWord(JobState state) {
  switch (state) {
    case JobState::kRunning:
      return "running";
    case JobState::kFinished:
      return "done";
    case JobState::kFailed:
      return "failed";
    case JobState::kStopped:
      return "stopped";
    default:
      return "none";
  }
}

Json JobJson(const JobStatus& job) {
  return {{"name", job.name},         {"state", JobWord(job.state)}, {"step", job.step},
          {"fraction", job.fraction}, {"seconds", job.seconds},      {"words", job.words}};
}

Json PredictedJson(const LandmarkChecks& checks) {
  Json json = Json::array();
  for (const auto& [site, point] : checks.predicted) {
    json.push_back({{"site", site}, {"point", point}});
  }
  return json;
}

Json StepsJson(const BenchHistory& history) {
  const auto what = [&history](int step) { return history.steps.at(step).what; };
  return {{"undo", CanUndo(history) ? Json(what(history.now)) : Json()},
          {"redo", CanRedo(history) ? Json(what(history.now + 1)) : Json()}};
}

Json DowelsJson(const std::vector<Dowel>& dowels) {
  Json json = Json::array();
  for (const Dowel& dowel : dowels) {
    if (dowel.Tip().allFinite()) {
      json.push_back({{"site", dowel.site},
                      {"base", dowel.base},
                      {"tip", dowel.Tip()},
                      {"depth_mm", dowel.depth_mm},
                      {"sd_mm", dowel.sd_mm}});
    }
  }
  return json;
}

Json SiteJson(const Site& site) {
  Json json = {{"site", site.code},
               {"name", site.name},
               {"number", site.number},
               {"mirror", site.mirror},
               {"definition", SiteDefinition(site.landmark)},
               {"standard", IsStandardSite(site.code)}};
  if (IsStandardSite(site.code)) {
    json["average"] = AverageSite(site.code);
  }
  return json;
}

}  // namespace

std::string SnapshotJson(const Bench::Snapshot& shot, const std::filesystem::path& folder) {
  const BenchState& state = CurrentState(shot.history);
  Json json = {{"revision", shot.revision},
               {"folder", folder.string()},
               {"subject", SubjectJson(shot)},
               {"landmarks", Json::array()},
               {"absent", Json::array()},
               {"predicted", PredictedJson(shot.checks)},
               {"errors", shot.checks.errors},
               {"notes", shot.checks.notes},
               {"settings", Json::array()},
               {"values", Json::parse(ExperimentJson(shot.experiment))},
               {"steps", StepsJson(shot.history)},
               {"edited_vertices", state.edits.edits.size()},
               {"job", JobJson(shot.job)},
               {"face",
                {{"there", shot.has_face},
                 {"head", std::filesystem::exists(folder / "run" / "bust.obj")},
                 {"fresh", shot.face_fresh},
                 {"saved", shot.run_saved},
                 {"revision", shot.face_revision}}},
               {"variants", Json::array()}};
  for (const BenchVariant variant : shot.variants) {
    json["variants"].push_back(VariantName(variant));
  }
  for (const BenchLandmark& landmark : state.landmarks) {
    json["landmarks"].push_back(LandmarkJson(landmark, shot.checks));
  }
  for (const BenchAbsent& absent : state.absent) {
    json["absent"].push_back({{"site", absent.site}, {"reason", absent.reason}});
  }
  for (const BenchSetting& setting : state.settings) {
    json["settings"].push_back({{"path", setting.path}, {"value", setting.value}});
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string FaceJson(const BenchFace& face) {
  return Json{{"mesh", EncodeMeshBlob(Tessellate(face.surface, kShownQuadsPerPatch).mesh)},
              {"dowels", DowelsJson(face.dowels)},
              {"notes", face.notes},
              {"faults", Json::parse(face.faults, nullptr, /*allow_exceptions=*/false)},
              {"finest_level", face.surface.shape().max_level},
              {"seconds", face.seconds}}
      .dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string PullMovesJson(const std::array<std::vector<Vec3>, 3>& moves) {
  Json json = {{"per_mm", Json::array()}};
  for (const std::vector<Vec3>& along : moves) {
    Json blobs = Json::array();
    for (int k = 0; k < 3; ++k) {
      std::vector<double> hundredths(along.size());
      std::ranges::transform(along, hundredths.begin(), [k](const Vec3& v) { return 100 * v[k]; });
      SceneBlobs one;
      const std::string name = one.AddValues(hundredths);
      blobs.push_back(one.All().at(name));
    }
    json["per_mm"].push_back(std::move(blobs));
  }
  return json.dump();
}

std::string ImportedFileJson(const ImportedFile& file) {
  Json json = {{"kind", EnumWord(file.kind)},
               {"path", file.path.string()},
               {"name", file.path.filename().string()},
               {"ways", Json::array()}};
  for (const OpenAs as : WaysToOpen(file.kind)) {
    json["ways"].push_back(EnumWord(as));
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string MeshesJson(const BenchSubject& subject) {
  Json json = {{"skull", nullptr}, {"skin", nullptr}};
  if (!subject.skull.view.triangles.empty()) {
    json["skull"] = EncodeMeshBlob(subject.skull.view);
  }
  if (subject.skin) {
    json["skin"] = EncodeMeshBlob(subject.skin->view);
  }
  return json.dump();
}

std::string SitesJson() {
  Json json = Json::array();
  for (const Site& site : AllSites()) {
    json.push_back(SiteJson(site));
  }
  return json.dump();
}

}  // namespace semblance::problems
