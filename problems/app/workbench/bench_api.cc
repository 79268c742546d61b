// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_api.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "problems/app/workbench/bench_actions.h"
#include "problems/app/workbench/bench_assets.h"
#include "problems/app/workbench/bench_json.h"
#include "problems/config/config.h"
#include "problems/experiment/experiment_config.h"
#include "problems/report/pictures/site_picture.h"
#include "problems/report/report_assets.h"
#include "problems/report/view/view_mesh.h"
#include "problems/subject/landmark_files/read_landmarks.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"
#include "surfaces/hspline_files/face_export.h"
#include "surfaces/mesh_files/mesh_io.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kJson = "application/json";

PageReply JsonReply(std::string body) { return {200, kJson, std::move(body), {}}; }

// Cuts the message, because it may quote a request of any length.
PageReply MessageReply(int status, const char* key, const std::string& message) {
  constexpr std::size_t kMaxMessage_bytes = 2000;
  return {status,
          kJson,
          Json{{key, message.substr(0, kMaxMessage_bytes)}}.dump(-1, ' ', false,
                                                                 Json::error_handler_t::replace),
          {}};
}

// The reply to a request that the page never makes.
PageReply ErrorReply(int status, const std::string& message) {
  return MessageReply(status, "error", message);
}

// The reply to a person's action that is impossible. Its status is 200, because a browser lists
// each status from 400 on as a fault of the page.
PageReply RefusalReply(const std::string& message) { return MessageReply(200, "refused", message); }

class BadRequest : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

Json ParseBody(const PageRequest& request) {
  try {
    return ParseJson(request.body, "the request");
  } catch (const IoError& error) {
    throw BadRequest(error.what());
  }
}

PageReply StateReply(Bench& bench) {
  return JsonReply(SnapshotJson(bench.TakeSnapshot(), bench.Folder()));
}

// ---------------------------------------------------------------------------------------------
// The page and its files
// ---------------------------------------------------------------------------------------------

const char* ContentType(const std::string& name) {
  constexpr std::array<std::pair<const char*, const char*>, 7> kTypes = {
      {{".html", "text/html; charset=utf-8"},
       {".css", "text/css; charset=utf-8"},
       {".js", "text/javascript; charset=utf-8"},
       {".json", kJson},
       {".png", "image/png"},
       {".svg", "image/svg+xml"},
       {".yaml", "text/plain; charset=utf-8"}}};
  const std::string extension = fs::path(name).extension().string();
  const auto* const found =
      std::ranges::find_if(kTypes, [&](const auto& type) { return extension == type.first; });
  return found == kTypes.end() ? "application/octet-stream" : found->second;
}

// Serves only files that are part of the program. No name leads to the disk.
PageReply PageFile(const std::string& path) {
  const std::string name = path.empty() ? "index.html" : path;
  if (name == "three.js") {
    return {200, ContentType(name), std::string(ThreeScript()), {}};
  }
  if (name == "report.css") {
    return {200, ContentType(name), std::string(ReportStyle()), {}};
  }
  if (name == "view.js") {
    return {200, ContentType(name), std::string(ReportPartsScript()), {}};
  }
  for (const BenchAsset& file : PageFiles()) {
    if (file.name == name) {
      return {200, ContentType(name), std::string(file.text), {}};
    }
  }
  return ErrorReply(404, fmt::format("the page has no file '{}'", name));
}

// Serves a file of the last run, never one outside run/.
PageReply RunFile(const Bench& bench, const std::string& name) {
  const fs::path root = bench.Folder() / "run";
  std::error_code error;
  const fs::path path = fs::canonical(root / name, error);
  const fs::path inside = error ? fs::path() : path.lexically_relative(fs::canonical(root));
  const bool is_inside = !inside.empty() && inside.begin()->string() != "..";
  if (error || !is_inside || !fs::is_regular_file(path)) {
    return ErrorReply(404, fmt::format("the last run has no file '{}'", name));
  }
  return {200, ContentType(name), ReadFileBytes(path), {}};
}

// ---------------------------------------------------------------------------------------------
// Requests that change nothing
// ---------------------------------------------------------------------------------------------

PageReply Meshes(Bench& bench, const PageRequest&) {
  return JsonReply(MeshesJson(*bench.TakeSnapshot().subject));
}

PageReply Sites(Bench&, const PageRequest&) { return JsonReply(SitesJson()); }

PageReply SitesPicture(Bench&, const PageRequest&) {
  static const std::string kPicture = SitePictureSvg(/*threads=*/1);
  return {200, "image/svg+xml", kPicture, {}};
}

std::string QueryText(const PageRequest& request, const char* key) {
  const auto at = request.query.find(key);
  return at == request.query.end() ? std::string() : at->second;
}

// Picture of the place of one site, for ?site=CODE.
PageReply SitePictureReply(Bench&, const PageRequest& request) {
  static const SiteSketch kSketch = MakeSiteSketch(/*threads=*/1);
  return {200, "image/png", EncodePng(DrawSitePicture(kSketch, QueryText(request, "site"))), {}};
}

PageReply Schema(Bench&, const PageRequest&) { return JsonReply(OptionsSchema<Experiment>()); }

// pooled: the table has one build and one sex.
Json TableJson(const fs::path& path) {
  const TissueTable table = ReadTissueTable(path);
  return {{"path", path.string()},
          {"title", table.title},
          {"population", table.population_label},
          {"citation", table.citation},
          {"pooled", table.rows.front().values.contains("adult")}};
}

// The files of the folder that options may name, the parts of the template and the kept features.
PageReply Files(Bench& bench, const PageRequest&) {
  Json json = {{"tables", Json::array()}, {"networks", Json::array()}};
  for (const auto& [kind, list] : json.items()) {
    const fs::path folder = bench.Folder() / kind;
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) {
      names.push_back(fs::path(kind) / entry.path().filename());
    }
    std::ranges::sort(names);
    for (const std::string& name : names) {
      const fs::path path = bench.Folder() / name;
      json[kind].push_back(kind == "tables" ? TableJson(path)
                                            : Json{{"path", path.string()}, {"title", name}});
    }
  }
  json["parts"] = bench.PartsOfFace();
  json["features"] = bench.KeptFeatures();
  return JsonReply(json.dump());
}

PageReply FaceReply(const BenchFace& face) { return JsonReply(FaceJson(face)); }

BenchVariant RequestedVariant(const PageRequest& request) {
  const auto name = request.query.find("variant");
  return name == request.query.end() ? BenchVariant::kAsIs : FindVariant(name->second);
}

PageReply CoarseReply(Bench& bench, const PageRequest& request) {
  const auto path = request.query.find("path"), value = request.query.find("value");
  if (path != request.query.end() && value != request.query.end()) {
    return FaceReply(bench.CoarseWith({path->second, value->second}));
  }
  return FaceReply(bench.Coarse(RequestedVariant(request)));
}

PageReply VariantReply(Bench& bench, const PageRequest& request) {
  return FaceReply(bench.FullVariant(RequestedVariant(request)));
}

PageReply FullReply(Bench& bench, const PageRequest&) { return FaceReply(bench.Full()); }

PageReply LandmarksFile(Bench& bench, const PageRequest& request) {
  const auto format = request.query.find("format");
  const std::string name =
      "landmarks" + (format == request.query.end() ? std::string(".yaml") : format->second);
  const LandmarkFile file = ToLandmarkFile(CurrentState(bench.TakeSnapshot().history));
  return {200, "application/octet-stream", EncodeLandmarks(file, name), name};
}

// Exports the face of the last run with its edits, or the face of a variant.
PageReply FaceFile(Bench& bench, const PageRequest& request) {
  const auto format = request.query.find("format");
  const std::string extension = format == request.query.end() ? ".ply" : format->second;
  const bool is_variant = request.query.contains("variant");
  const BenchFace face = is_variant ? bench.FullVariant(RequestedVariant(request)) : bench.Full();
  const std::string name =
      is_variant ? std::string(VariantName(RequestedVariant(request))) : std::string("face");
  return {200, "application/octet-stream",
          EncodeFace(face.surface, extension, /*chord_mm=*/std::nullopt, /*threads=*/1),
          name + extension};
}

// The complete head of the last run in mm, LPS. Throws InputError if run/ holds none of the present
// state.
TriMesh CompleteHead(Bench& bench) {
  const fs::path file = bench.Folder() / "run" / "bust.obj";
  if (!bench.TakeSnapshot().run_saved) {
    throw InputError("the head belongs to another state; make the face first");
  }
  if (!fs::exists(file)) {
    throw InputError("this template has no head; set the option `bust`, and make the face again");
  }
  return ReadMesh(file);
}

PageReply HeadReply(Bench& bench, const PageRequest&) {
  return JsonReply(Json{{"mesh", EncodeMeshBlob(SimplifyForView(CompleteHead(bench)))}}.dump());
}

// Exports the complete head: the run's own file for .glb, which has colours, or its mesh.
PageReply HeadFile(Bench& bench, const PageRequest& request) {
  const std::string format = QueryText(request, "format");
  const TriMesh head = CompleteHead(bench);
  if (format == ".glb") {
    return {200, "application/octet-stream", ReadFileBytes(bench.Folder() / "run" / "bust.glb"),
            "head.glb"};
  }
  return {200, "application/octet-stream", EncodeMesh(head, format), "head" + format};
}

// ---------------------------------------------------------------------------------------------
// Actions
// ---------------------------------------------------------------------------------------------

Vec3 ReadVector(const Json& json, const char* key) {
  const auto numbers = json.at(key).get<std::array<double, 3>>();
  return {numbers[0], numbers[1], numbers[2]};
}

// A NUL would end a path early for the system, but not for the checks of its name.
std::string ReadText(const Json& json, const char* key) {
  std::string text = json.at(key).get<std::string>();
  if (text.find('\0') != std::string::npos) {
    throw InputError(fmt::format("{}: the text has the character NUL; leave it out", key));
  }
  return text;
}

template <class Enum>
Enum ReadEnum(const Json& json, const char* key) {
  constexpr auto kNames = EnumNames(Enum{});
  const auto* const name = std::ranges::find(kNames, ReadText(json, key));
  if (name == kNames.end()) {
    throw InputError(fmt::format("{}: '{}' is unknown; give one of {}", key, ReadText(json, key),
                                 fmt::join(kNames, ", ")));
  }
  return static_cast<Enum>(name - kNames.begin());
}

LandmarkRemarks ReadRemarks(const Json& json) {
  LandmarkRemarks remarks{.certainty = ReadEnum<Certainty>(json, "certainty"),
                          .note = ReadText(json, "note")};
  if (!json.at("depth_mm").is_null()) {
    remarks.depth_along_normal_mm = json.at("depth_mm").get<double>();
  }
  return remarks;
}

// The dowel of ?site=CODE.
PageReply DirectionReply(Bench& bench, const PageRequest& request) {
  const Bench::DowelDirection dowel = bench.FindDirection(QueryText(request, "site"));
  return JsonReply(
      Json{{"base", dowel.base}, {"own", dowel.own}, {"direction", dowel.direction}}.dump());
}

using Action = void (*)(Bench&, const Json&);

void Place(Bench& bench, const Json& json) {
  bench.PlaceByRay(ReadText(json, "site"), ReadVector(json, "origin"),
                   ReadVector(json, "direction"), ReadVector(json, "near"));
}
void Turn(Bench& bench, const Json& json) {
  bench.TurnDowel(ReadText(json, "site"), json.at("direction").is_null()
                                              ? std::nullopt
                                              : std::optional(ReadVector(json, "direction")));
}
void Remove(Bench& bench, const Json& json) {
  const std::string site = ReadText(json, "site");
  bench.Apply("removed " + site, [&](BenchState s) { return RemoveLandmark(std::move(s), site); });
}
void Rename(Bench& bench, const Json& json) {
  const std::string site = ReadText(json, "site"), name = ReadText(json, "name");
  bench.Apply(fmt::format("renamed {} to {}", site, name),
              [&](BenchState s) { return RenameLandmark(std::move(s), site, name); });
}
void Absent(Bench& bench, const Json& json) {
  const std::string site = ReadText(json, "site");
  bench.Apply("marked " + site + " absent", [&](BenchState s) {
    return MarkAbsent(std::move(s), site, ReadText(json, "reason"));
  });
}
void Remark(Bench& bench, const Json& json) {
  const std::string site = ReadText(json, "site");
  bench.Apply("remarked on " + site,
              [&](BenchState s) { return RemarkLandmark(std::move(s), site, ReadRemarks(json)); });
}
void Confirm(Bench& bench, const Json& json) {
  const std::string site = ReadText(json, "site");
  bench.Apply("confirmed " + site,
              [&](BenchState s) { return ConfirmLandmark(std::move(s), site); });
}
void ConfirmAll(Bench& bench, const Json&) {
  bench.Apply("confirmed all", [](BenchState s) { return ConfirmAllLandmarks(std::move(s)); });
}
void LeaveOutDoubtful(Bench& bench, const Json&) {
  bench.Apply("left out the doubtful landmarks",
              [](BenchState s) { return LeaveOutDoubtfulLandmarks(std::move(s)); });
}
void ClearLandmarks(Bench& bench, const Json&) {
  bench.Apply("removed all landmarks",
              [](BenchState s) { return ReplaceLandmarks(std::move(s), {}); });
}
void Set(Bench& bench, const Json& json) {
  const std::string path = ReadText(json, "path");
  if (path == "subject.axes" || path == "subject.units") {
    bench.CorrectFrame(path, json.at("value").dump());
    return;
  }
  bench.Apply("set " + path, [&](BenchState s) {
    return ChangeSetting(std::move(s), path, json.at("value").dump());
  });
}
void Name(Bench& bench, const Json& json) {
  const std::string name = ReadText(json, "name");
  bench.Apply("named the case", [&](BenchState s) { return NameCase(std::move(s), name); });
}
void RemoveBone(Bench& bench, const Json& json) {
  const Json& within = json.at("within_mm");
  bench.RemoveBone(ReadVector(json, "near"),
                   within.is_null() ? std::nullopt : std::optional(within.get<double>()));
}
void Unset(Bench& bench, const Json& json) {
  const std::string path = ReadText(json, "path");
  bench.Apply("reset " + path, [&](BenchState s) { return DropSetting(std::move(s), path); });
}
Pull ReadPull(const Json& json) {
  return {.level = json_parts::IntFromJson(json.at("level")),
          .reach = json.at("reach").get<double>(),
          .mirror = json.at("mirror").get<bool>()};
}
void PullFace(Bench& bench, const Json& json) {
  Pull pull = ReadPull(json);
  pull.by_mm = ReadVector(json, "by");
  bench.PullAt(ReadVector(json, "at"), pull);
}
void BrushFace(Bench& bench, const Json& json) {
  bench.BrushAt(ReadVector(json, "at"), {.kind = ReadEnum<BrushKind>(json, "kind"),
                                         .level = json_parts::IntFromJson(json.at("level")),
                                         .strength = json.at("strength").get<double>(),
                                         .reach = json.at("reach").get<double>(),
                                         .mirror = json.at("mirror").get<bool>()});
}
void ClearEdits(Bench& bench, const Json&) {
  bench.Apply("removed all edits", [](BenchState s) { return ReplaceEdits(std::move(s), {}); });
}
void Keep(Bench& bench, const Json& json) {
  bench.KeepFeature(ReadText(json, "part"), ReadText(json, "name"));
}
void Blend(Bench& bench, const Json& json) {
  bench.BlendFeature(ReadText(json, "name"), json.at("weight").get<double>());
}
// Empty if the key is missing.
std::string ReadOptionalText(const Json& json, const char* key) {
  return json.contains(key) && json.at(key).is_string() ? ReadText(json, key) : "";
}
void OpenFile(Bench& bench, const Json& json) {
  OpenRequest request{
      .path = ReadText(json, "path"), .as = ReadEnum<OpenAs>(json, "as"), .volume = {}, .axes = {}};
  if (json.contains("volume")) {
    request.volume = ReadConfigText<CtSubject>(json.at("volume").dump(), "volume");
  }
  if (!ReadOptionalText(json, "axes").empty()) {
    request.axes = ReadEnum<Axes>(json, "axes");
  }
  bench.StartOpening(request);
}
void Forget(Bench& bench, const Json& json) {
  DropIncoming(bench.Folder(), ReadText(json, "batch"));
}
void MakeVariants(Bench& bench, const Json& json) {
  std::vector<BenchVariant> variants;
  for (const Json& name : json.at("variants")) {
    variants.push_back(FindVariant(name.get<std::string>()));
  }
  bench.StartVariants(variants);
}
void UndoStep(Bench& bench, const Json&) { bench.Undo(); }
void RedoStep(Bench& bench, const Json&) { bench.Redo(); }
void RunFace(Bench& bench, const Json&) { bench.StartRun(); }
void ProposeSites(Bench& bench, const Json&) { bench.StartProposal(); }
void Cancel(Bench& bench, const Json&) { bench.CancelJob(); }

constexpr std::array<std::pair<std::string_view, Action>, 27> kActions = {
    {{"place", &Place},
     {"turn", &Turn},
     {"remove", &Remove},
     {"rename", &Rename},
     {"absent", &Absent},
     {"remark", &Remark},
     {"confirm", &Confirm},
     {"confirm_all", &ConfirmAll},
     {"leave_out_doubtful", &LeaveOutDoubtful},
     {"clear_landmarks", &ClearLandmarks},
     {"set", &Set},
     {"unset", &Unset},
     {"name", &Name},
     {"remove_bone", &RemoveBone},
     {"open", &OpenFile},
     {"forget", &Forget},
     {"pull", &PullFace},
     {"brush", &BrushFace},
     {"clear_edits", &ClearEdits},
     {"keep_feature", &Keep},
     {"blend_feature", &Blend},
     {"undo", &UndoStep},
     {"redo", &RedoStep},
     {"run", &RunFace},
     {"propose", &ProposeSites},
     {"variants", &MakeVariants},
     {"cancel", &Cancel}}};

PageReply Act(Bench& bench, const PageRequest& request) {
  const Json json = ParseBody(request);
  const std::string name = ReadText(json, "do");
  const auto* const found =
      std::ranges::find(kActions, name, &decltype(kActions)::value_type::first);
  if (found == kActions.end()) {
    return ErrorReply(400, fmt::format("unknown action '{}'", name));
  }
  found->second(bench, json);
  return StateReply(bench);
}

// Stores a file from the browser until it is opened.
PageReply Upload(Bench& bench, const PageRequest& request) {
  const fs::path path = SaveIncoming(bench.Folder(), QueryText(request, "batch"),
                                     QueryText(request, "name"), request.body);
  return JsonReply(Json{{"path", path.string()}}.dump());
}

// Identifies a path on this machine or the files of an uploaded batch.
PageReply Identify(Bench& bench, const PageRequest& request) {
  const Json json = ParseBody(request);
  const std::string batch = ReadOptionalText(json, "batch");
  const fs::path path =
      batch.empty() ? fs::path(ReadText(json, "path")) : IncomingBatch(bench.Folder(), batch);
  return JsonReply(ImportedFileJson(IdentifyImport(path)));
}

// The displacements of the shown vertices, for the preview of a pull.
PageReply PullPreview(Bench& bench, const PageRequest& request) {
  const Json json = ParseBody(request);
  return JsonReply(PullMovesJson(bench.PullMovesAt(ReadVector(json, "at"), ReadPull(json))));
}

PageReply State(Bench& bench, const PageRequest&) { return StateReply(bench); }

// ---------------------------------------------------------------------------------------------
// A volume before it is opened: ?path=FILE_OR_FOLDER&series=NAME
// ---------------------------------------------------------------------------------------------

PageReply SeriesReply(Bench& bench, const PageRequest& request) {
  Json json = Json::array();
  for (const VolumeSeries& series : bench.FindSeries(QueryText(request, "path"))) {
    json.push_back({{"name", series.name},
                    {"description", series.description},
                    {"modality", series.modality},
                    {"slices", series.slices},
                    {"columns", series.columns},
                    {"rows", series.rows}});
  }
  return JsonReply(json.dump());
}

std::shared_ptr<const VolumeReading> RequestedVolume(Bench& bench, const PageRequest& request) {
  return bench.ReadUnopened(QueryText(request, "path"),
                            {.series = QueryText(request, "series"),
                             .fill_slices = QueryText(request, "fill") == "true"});
}

PageReply VolumeReply(Bench& bench, const PageRequest& request) {
  const auto reading = RequestedVolume(bench, request);
  return JsonReply(Json{
      {"is_mr", reading->modality == Modality::kMr},
      {"counts", {reading->volume.columns, reading->volume.rows, reading->volume.slices}},
      {"notes",
       reading->notes}}.dump(-1, ' ', false, Json::error_handler_t::replace));
}

// A number of the query; `usual` if it is missing. Throws BadRequest for other texts.
double QueryNumber(const PageRequest& request, const char* key, double usual) {
  const std::string text = QueryText(request, key);
  double number = usual;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (!text.empty() && (error != std::errc() || end != text.data() + text.size())) {
    throw BadRequest(fmt::format("{}: this is no number", key));
  }
  return number;
}

PageReply SliceReply(Bench& bench, const PageRequest& request) {
  SliceOptions options{.at = QueryNumber(request, "at", 0.5),
                       .bone_hu = QueryNumber(request, "bone_hu", kNaN),
                       .skin_hu = QueryNumber(request, "skin_hu", kNaN),
                       .longest_side = QueryNumber(request, "side", 320)};
  options.plane = ReadEnum<SlicePlane>(Json{{"plane", QueryText(request, "plane")}}, "plane");
  return {200,
          "image/png",
          EncodePng(DrawSlice(RequestedVolume(bench, request)->volume, options), PngEffort::kQuick),
          {}};
}

using Handler = PageReply (*)(Bench&, const PageRequest&);
struct Route {
  std::string_view method, path;
  Handler handle;
};

constexpr std::array kRoutes = {
    Route{"GET", "api/state", &State},
    Route{"GET", "api/schema", &Schema},
    Route{"GET", "api/sites", &Sites},
    Route{"GET", "api/sites.svg", &SitesPicture},
    Route{"GET", "api/site.png", &SitePictureReply},
    Route{"GET", "api/direction", &DirectionReply},
    Route{"GET", "api/files", &Files},
    Route{"GET", "api/meshes", &Meshes},
    Route{"GET", "api/coarse", &CoarseReply},
    Route{"GET", "api/face", &FullReply},
    Route{"GET", "api/variant", &VariantReply},
    Route{"GET", "api/landmarks", &LandmarksFile},
    Route{"GET", "api/export", &FaceFile},
    Route{"GET", "api/head", &HeadReply},
    Route{"GET", "api/series", &SeriesReply},
    Route{"GET", "api/volume", &VolumeReply},
    Route{"GET", "api/slice.png", &SliceReply},
    Route{"GET", "api/export_head", &HeadFile},
    Route{"POST", "api/act", &Act},
    Route{"POST", "api/look", &Identify},
    Route{"POST", "api/pull", &PullPreview},
    Route{"POST", "api/upload", &Upload},
};

PageReply Find(Bench& bench, const PageRequest& request) {
  for (const Route& route : kRoutes) {
    if (route.path == request.path) {
      return route.method == request.method
                 ? route.handle(bench, request)
                 : ErrorReply(405, fmt::format("{} takes {}", route.path, route.method));
    }
  }
  if (request.method != "GET") {
    return ErrorReply(404, "this address takes no POST");
  }
  constexpr std::string_view kRun = "run/";
  return request.path.starts_with(kRun) ? RunFile(bench, request.path.substr(kRun.size()))
                                        : PageFile(request.path);
}

}  // namespace

PageReply Answer(Bench& bench, const PageRequest& request) {
  try {
    return Find(bench, request);
  } catch (const Error& error) {
    return RefusalReply(error.what());
  } catch (const BadRequest& error) {
    return ErrorReply(400, error.what());
  } catch (const nlohmann::json::exception& error) {
    return ErrorReply(400, fmt::format("the request is not valid: {}", JsonFault(error)));
  } catch (const Cancelled&) {
    return RefusalReply("stopped");
  } catch (const std::bad_alloc&) {
    return ErrorReply(507, "not enough memory");
  } catch (const fs::filesystem_error& error) {
    return RefusalReply(fmt::format("a file cannot be used: {}", error.code().message()));
  } catch (const std::exception& error) {
    return ErrorReply(500, fmt::format("the work failed: {}", error.what()));
  }
}

}  // namespace semblance::problems
