// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/serving/bench_api.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "problems/config/config.h"
#include "problems/landmark_files/read_landmarks.h"
#include "problems/landmark_files/site_picture.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/report/report_assets.h"
#include "problems/serving/bench_json.h"
#include "problems/workbench/bench_actions.h"
#include "problems/workbench/bench_assets.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"
#include "surfaces/hspline_files/face_export.h"
#include "surfaces/hspline_files/json_parts.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kJson = "application/json";

BenchReply JsonReply(std::string body) { return {200, kJson, std::move(body), {}}; }

// Words that quote what was sent may be as long as that.
BenchReply WordsReply(int status, const char* key, const std::string& words) {
  constexpr std::size_t kMost = 2000;
  return {status,
          kJson,
          Json{{key, words.substr(0, kMost)}}.dump(-1, ' ', false, Json::error_handler_t::replace),
          {}};
}

// A request that the page does not make.
BenchReply Fault(int status, const std::string& words) {
  return WordsReply(status, "error", words);
}

// What a person cannot have is an answer like any other: a browser lists each status from 400 on
// as a fault of the page.
BenchReply Refusal(const std::string& words) { return WordsReply(200, "refused", words); }

class BadRequest : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

Json BodyOf(const BenchRequest& request) {
  try {
    return ParseJson(request.body, "the request");
  } catch (const IoError& error) {
    throw BadRequest(error.what());
  }
}

BenchReply StateReply(const Bench& bench) {
  return JsonReply(SnapshotJson(bench.TakeSnapshot(), bench.Folder()));
}

// ---------------------------------------------------------------------------------------------
// The page and its files
// ---------------------------------------------------------------------------------------------

const char* TypeOf(const std::string& name) {
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

// Only what the program carries: no name leads to the disk.
BenchReply PageFile(const std::string& path) {
  const std::string name = path.empty() ? "index.html" : path;
  if (name == "three.js") {
    return {200, TypeOf(name), std::string(ThreeScript()), {}};
  }
  if (name == "report.css") {
    return {200, TypeOf(name), std::string(ReportStyle()), {}};
  }
  if (name == "view.js") {
    return {200, TypeOf(name), std::string(ReportPartsScript()), {}};
  }
  for (const BenchAsset& file : PageFiles()) {
    if (file.name == name) {
      return {200, TypeOf(name), std::string(file.text), {}};
    }
  }
  return Fault(404, fmt::format("there is no '{}' here", name));
}

// A file of the last run: one that its manifest or its report names, never one outside run/.
BenchReply RunFile(const Bench& bench, const std::string& name) {
  const fs::path root = bench.Folder() / "run";
  std::error_code error;
  const fs::path path = fs::canonical(root / name, error);
  const fs::path inside = error ? fs::path() : path.lexically_relative(fs::canonical(root));
  const bool is_inside = !inside.empty() && inside.begin()->string() != "..";
  if (error || !is_inside || !fs::is_regular_file(path)) {
    return Fault(404, fmt::format("the last run has no '{}'", name));
  }
  return {200, TypeOf(name), ReadFileBytes(path), {}};
}

// ---------------------------------------------------------------------------------------------
// Asking
// ---------------------------------------------------------------------------------------------

BenchReply Meshes(Bench& bench, const BenchRequest&) {
  return JsonReply(MeshesJson(*bench.TakeSnapshot().subject));
}

BenchReply Sites(Bench&, const BenchRequest&) { return JsonReply(SitesJson()); }

BenchReply SitesPicture(Bench&, const BenchRequest&) {
  static const std::string kPicture = SitePictureSvg(/*threads=*/1);
  return {200, "image/svg+xml", kPicture, {}};
}

std::string QueryText(const BenchRequest& request, const char* key) {
  const auto at = request.query.find(key);
  return at == request.query.end() ? std::string() : at->second;
}

// Where one site lies, for ?site=CODE.
BenchReply SitePictureReply(Bench&, const BenchRequest& request) {
  static const SiteSketch kSketch = MakeSiteSketch(/*threads=*/1);
  return {200, "image/png", EncodePng(PictureOf(kSketch, QueryText(request, "site"))), {}};
}

BenchReply Schema(Bench&, const BenchRequest&) { return JsonReply(OptionsSchema<Experiment>()); }

// Files that an option may name: those of the folder that fit.
BenchReply Files(Bench& bench, const BenchRequest&) {
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
      json[kind].push_back({{"path", path.string()},
                            {"title", kind == "tables" ? ReadTissueTable(path).title : name}});
    }
  }
  json["parts"] = bench.PartsOfFace();
  json["features"] = bench.KeptFeatures();
  return JsonReply(json.dump());
}

BenchReply FaceReply(const BenchFace& face) { return JsonReply(FaceJson(face)); }

BenchVariant VariantAsked(const BenchRequest& request) {
  const auto asked = request.query.find("variant");
  return asked == request.query.end() ? BenchVariant::kAsIs : FindVariant(asked->second);
}

BenchReply CoarseReply(Bench& bench, const BenchRequest& request) {
  const auto path = request.query.find("path"), value = request.query.find("value");
  if (path != request.query.end() && value != request.query.end()) {
    return FaceReply(bench.CoarseWith({path->second, value->second}));
  }
  return FaceReply(bench.Coarse(VariantAsked(request)));
}

BenchReply VariantReply(Bench& bench, const BenchRequest& request) {
  return FaceReply(bench.FullVariant(VariantAsked(request)));
}

BenchReply FullReply(Bench& bench, const BenchRequest&) { return FaceReply(bench.Full()); }

BenchReply LandmarksFile(Bench& bench, const BenchRequest& request) {
  const auto format = request.query.find("format");
  const std::string name =
      "landmarks" + (format == request.query.end() ? std::string(".yaml") : format->second);
  const LandmarkFile file = ToLandmarkFile(CurrentState(bench.TakeSnapshot().history));
  return {200, "application/octet-stream", EncodeLandmarks(file, name), name};
}

// The face of the last run with its edits, or that of a variant, for other programs.
BenchReply FaceFile(Bench& bench, const BenchRequest& request) {
  const auto format = request.query.find("format");
  const std::string extension = format == request.query.end() ? ".ply" : format->second;
  const bool is_variant = request.query.contains("variant");
  const BenchFace face = is_variant ? bench.FullVariant(VariantAsked(request)) : bench.Full();
  const std::string name =
      is_variant ? std::string(VariantName(VariantAsked(request))) : std::string("face");
  return {200, "application/octet-stream",
          EncodeFace(face.surface, extension, /*chord_mm=*/std::nullopt, /*threads=*/1),
          name + extension};
}

// ---------------------------------------------------------------------------------------------
// Doing
// ---------------------------------------------------------------------------------------------

Vec3 VectorOf(const Json& json, const char* key) {
  const auto numbers = json.at(key).get<std::array<double, 3>>();
  return {numbers[0], numbers[1], numbers[2]};
}

std::string TextOf(const Json& json, const char* key) { return json.at(key).get<std::string>(); }

LandmarkRemarks RemarksOf(const Json& json) {
  constexpr auto kWords = EnumNames(Certainty{});
  const auto* const word = std::ranges::find(kWords, TextOf(json, "certainty"));
  if (word == kWords.end()) {
    throw InputError("certainty: give high, medium or low");
  }
  LandmarkRemarks remarks{.certainty = static_cast<Certainty>(word - kWords.begin()),
                          .note = TextOf(json, "note")};
  if (!json.at("depth_mm").is_null()) {
    remarks.depth_along_normal_mm = json.at("depth_mm").get<double>();
  }
  return remarks;
}

using Action = void (*)(Bench&, const Json&);

void Place(Bench& bench, const Json& json) {
  bench.PlaceByRay(TextOf(json, "site"), VectorOf(json, "origin"), VectorOf(json, "direction"),
                   VectorOf(json, "near"));
}
void Remove(Bench& bench, const Json& json) {
  const std::string site = TextOf(json, "site");
  bench.Apply("removed " + site, [&](BenchState s) { return RemoveLandmark(std::move(s), site); });
}
void Rename(Bench& bench, const Json& json) {
  const std::string site = TextOf(json, "site"), name = TextOf(json, "name");
  bench.Apply(fmt::format("renamed {} to {}", site, name),
           [&](BenchState s) { return RenameLandmark(std::move(s), site, name); });
}
void Absent(Bench& bench, const Json& json) {
  const std::string site = TextOf(json, "site");
  bench.Apply("called " + site + " absent",
           [&](BenchState s) { return MarkAbsent(std::move(s), site, TextOf(json, "reason")); });
}
void Remark(Bench& bench, const Json& json) {
  const std::string site = TextOf(json, "site");
  bench.Apply("remarked on " + site,
           [&](BenchState s) { return RemarkLandmark(std::move(s), site, RemarksOf(json)); });
}
void Confirm(Bench& bench, const Json& json) {
  const std::string site = TextOf(json, "site");
  bench.Apply("confirmed " + site, [&](BenchState s) { return ConfirmLandmark(std::move(s), site); });
}
void ConfirmAll(Bench& bench, const Json&) {
  bench.Apply("confirmed all", [](BenchState s) { return ConfirmAllLandmarks(std::move(s)); });
}
void ClearLandmarks(Bench& bench, const Json&) {
  bench.Apply("removed all landmarks", [](BenchState s) { return ReplaceLandmarks(std::move(s), {}); });
}
void Predicted(Bench& bench, const Json&) { bench.AcceptPredicted(); }
void Set(Bench& bench, const Json& json) {
  const std::string path = TextOf(json, "path");
  if (path == "subject.axes" || path == "subject.units") {
    bench.CorrectFrame(path, json.at("value").dump());
    return;
  }
  bench.Apply("set " + path, [&](BenchState s) {
    return ChangeSetting(std::move(s), path, json.at("value").dump());
  });
}
void Unset(Bench& bench, const Json& json) {
  const std::string path = TextOf(json, "path");
  bench.Apply("reset " + path, [&](BenchState s) { return DropSetting(std::move(s), path); });
}
Pull PullOf(const Json& json) {
  return {.level = json_parts::IntFromJson(json.at("level")),
          .reach = json.at("reach").get<double>(),
          .mirror = json.at("mirror").get<bool>()};
}
void PullFace(Bench& bench, const Json& json) {
  Pull pull = PullOf(json);
  pull.by_mm = VectorOf(json, "by");
  bench.PullAt(VectorOf(json, "at"), pull);
}
void ClearEdits(Bench& bench, const Json&) {
  bench.Apply("took all edits back", [](BenchState s) { return ReplaceEdits(std::move(s), {}); });
}
void Keep(Bench& bench, const Json& json) {
  bench.KeepFeature(TextOf(json, "part"), TextOf(json, "name"));
}
void Blend(Bench& bench, const Json& json) {
  bench.BlendFeature(TextOf(json, "name"), json.at("weight").get<double>());
}
std::string TextOr(const Json& json, const char* key) {
  return json.contains(key) && json.at(key).is_string() ? TextOf(json, key) : "";
}
template <class Enum>
Enum WordOf(const Json& json, const char* key) {
  constexpr auto kWords = EnumNames(Enum{});
  const auto* const word = std::ranges::find(kWords, TextOf(json, key));
  if (word == kWords.end()) {
    throw InputError(fmt::format("{}: there is no '{}'", key, TextOf(json, key)));
  }
  return static_cast<Enum>(word - kWords.begin());
}
void OpenFile(Bench& bench, const Json& json) {
  OpenRequest request{
      .path = TextOf(json, "path"), .as = WordOf<OpenAs>(json, "as"), .volume = {}, .axes = {}};
  if (json.contains("volume")) {
    request.volume = ReadConfigText<CtSubject>(json.at("volume").dump(), "volume");
  }
  if (!TextOr(json, "axes").empty()) {
    request.axes = WordOf<Axes>(json, "axes");
  }
  bench.StartOpening(request);
}
void Forget(Bench& bench, const Json& json) { DropIncoming(bench.Folder(), TextOf(json, "batch")); }
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

constexpr std::array<std::pair<std::string_view, Action>, 23> kActions = {
    {{"place", &Place},
     {"remove", &Remove},
     {"rename", &Rename},
     {"absent", &Absent},
     {"remark", &Remark},
     {"confirm", &Confirm},
     {"confirm_all", &ConfirmAll},
     {"clear_landmarks", &ClearLandmarks},
     {"take_predicted", &Predicted},
     {"set", &Set},
     {"unset", &Unset},
     {"open", &OpenFile},
     {"forget", &Forget},
     {"pull", &PullFace},
     {"clear_edits", &ClearEdits},
     {"keep_feature", &Keep},
     {"blend_feature", &Blend},
     {"undo", &UndoStep},
     {"redo", &RedoStep},
     {"run", &RunFace},
     {"propose", &ProposeSites},
     {"variants", &MakeVariants},
     {"cancel", &Cancel}}};

BenchReply Act(Bench& bench, const BenchRequest& request) {
  const Json json = BodyOf(request);
  const std::string name = TextOf(json, "do");
  const auto* const found =
      std::ranges::find(kActions, name, &decltype(kActions)::value_type::first);
  if (found == kActions.end()) {
    return Fault(400, fmt::format("there is no action '{}'", name));
  }
  found->second(bench, json);
  return StateReply(bench);
}

// A file from the browser, until it is opened.
BenchReply Upload(Bench& bench, const BenchRequest& request) {
  const fs::path path = SaveIncoming(bench.Folder(), QueryText(request, "batch"),
                                     QueryText(request, "name"), request.body);
  return JsonReply(Json{{"path", path.string()}}.dump());
}

// What a path of this machine is, or what the browser has sent in a batch.
BenchReply LookAtPath(Bench& bench, const BenchRequest& request) {
  const Json json = BodyOf(request);
  const std::string batch = TextOr(json, "batch");
  const fs::path path =
      batch.empty() ? fs::path(TextOf(json, "path")) : IncomingBatch(bench.Folder(), batch);
  return JsonReply(ImportedFileJson(IdentifyImport(path)));
}

// How each vertex goes with a pull: for the page to draw it while the pointer moves.
BenchReply PullShape(Bench& bench, const BenchRequest& request) {
  const Json json = BodyOf(request);
  return JsonReply(PullMovesJson(bench.PullMovesAt(VectorOf(json, "at"), PullOf(json))));
}

BenchReply State(Bench& bench, const BenchRequest&) { return StateReply(bench); }

using Handler = BenchReply (*)(Bench&, const BenchRequest&);
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
    Route{"GET", "api/files", &Files},
    Route{"GET", "api/meshes", &Meshes},
    Route{"GET", "api/coarse", &CoarseReply},
    Route{"GET", "api/face", &FullReply},
    Route{"GET", "api/variant", &VariantReply},
    Route{"GET", "api/landmarks", &LandmarksFile},
    Route{"GET", "api/export", &FaceFile},
    Route{"POST", "api/act", &Act},
    Route{"POST", "api/look", &LookAtPath},
    Route{"POST", "api/pull", &PullShape},
    Route{"POST", "api/upload", &Upload},
};

BenchReply Find(Bench& bench, const BenchRequest& request) {
  for (const Route& route : kRoutes) {
    if (route.path == request.path) {
      return route.method == request.method
                 ? route.handle(bench, request)
                 : Fault(405, fmt::format("{} takes {}", route.path, route.method));
    }
  }
  if (request.method != "GET") {
    return Fault(404, "there is nothing to post to here");
  }
  constexpr std::string_view kRun = "run/";
  return request.path.starts_with(kRun) ? RunFile(bench, request.path.substr(kRun.size()))
                                        : PageFile(request.path);
}

}  // namespace

BenchReply Answer(Bench& bench, const BenchRequest& request) {
  try {
    return Find(bench, request);
  } catch (const Error& error) {
    return Refusal(error.what());
  } catch (const BadRequest& error) {
    return Fault(400, error.what());
  } catch (const nlohmann::json::exception& error) {
    return Fault(400, fmt::format("the request cannot be used: {}", JsonFault(error)));
  } catch (const Cancelled&) {
    return Refusal("stopped");
  } catch (const std::bad_alloc&) {
    return Fault(507, "not enough memory");
  } catch (const fs::filesystem_error& error) {
    return Refusal(fmt::format("a path: {}", error.code().message()));
  } catch (const std::exception& error) {
    return Fault(500, fmt::format("the work failed: {}", error.what()));
  }
}

}  // namespace semblance
