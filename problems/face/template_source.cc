// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/template_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>

#include "problems/face/ict_face.h"
#include "problems/face/template_placement.h"
#include "problems/subject/sites.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"
#include "surfaces/hspline_files/hspline_json.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "semblance template features";
constexpr int kVersion = 1;

// ---------------------------------------------------------------------------------------------
// Checks
// ---------------------------------------------------------------------------------------------

std::vector<SkinLandmark> SitesOnSurface(const TemplateFace& face) {
  std::vector<SkinLandmark> sites;
  for (const std::string& code : StandardSiteCodes()) {
    sites.push_back({code, face.surface.Point(face.site_uv.at(code))});
  }
  return sites;
}

void CheckSites(const TemplateFace& face) {
  for (const std::string& code : StandardSiteCodes()) {
    if (!face.site_uv.contains(code)) {
      throw InputError(
          fmt::format("site '{}' is missing; a template needs the (u,v) of all 32 sites", code));
    }
  }
  for (const auto& [code, uv] : face.site_uv) {
    if (!(uv.minCoeff() >= 0 && uv.maxCoeff() <= 1)) {
      throw InputError(fmt::format("site '{}' has (u,v) = ({}, {}); both must lie in [0, 1]", code,
                                   uv.x(), uv.y()));
    }
  }
  CheckSides(SitesOnSurface(face));
}

void CheckVertex(const TemplateFeature& feature, const VertexId& id, const HSplineShape& shape) {
  if (id.level < 1 || id.level > shape.max_level || id.i < 0 || id.i >= shape.Columns(id.level) ||
      id.j < 0 || id.j >= shape.Rows(id.level)) {
    throw InputError(
        fmt::format("feature '{}' names vertex [{}, {}, {}] (level, i, j), which is not one of the "
                    "surface's levels 1 to {}",
                    feature.name, id.level, id.i, id.j, shape.max_level));
  }
}

void CheckFeatures(const TemplateFace& face) {
  for (const TemplateFeature& feature : face.features) {
    for (const VertexId& id : feature.vertices) {
      CheckVertex(feature, id, face.surface.shape());
    }
    if (feature.region && !(feature.region->center.allFinite() && feature.region->radius_mm > 0 &&
                            std::isfinite(feature.region->radius_mm))) {
      throw InputError(
          fmt::format("feature '{}' has a region with radius_mm {}; it must be positive and "
                      "the center finite",
                      feature.name, feature.region->radius_mm));
    }
  }
}

// ---------------------------------------------------------------------------------------------
// Writing
// ---------------------------------------------------------------------------------------------

Json ToJson(const TemplateFeature& feature) {
  Json vertices = Json::array();
  for (const VertexId& id : feature.vertices) {
    vertices.push_back({id.level, id.i, id.j});
  }
  Json json{{"name", feature.name}, {"vertices", std::move(vertices)}};
  if (feature.region) {
    const Vec3& c = feature.region->center;
    json["region"] = {{"center", {c.x(), c.y(), c.z()}}, {"radius_mm", feature.region->radius_mm}};
  }
  return json;
}

std::string FeaturesText(const TemplateFace& face) {
  Json features = Json::array();
  for (const TemplateFeature& feature : face.features) {
    features.push_back(ToJson(feature));
  }
  const Json json{{"format", kFormat}, {"version", kVersion}, {"features", std::move(features)}};
  return json.dump(1) + "\n";
}

std::string SitesText(const TemplateFace& face) {
  CsvWriter csv({"site", "u", "v"});
  for (const auto& [code, uv] : face.site_uv) {
    csv.Row(code, uv.x(), uv.y());
  }
  return csv.Text();
}

// ---------------------------------------------------------------------------------------------
// Reading
// ---------------------------------------------------------------------------------------------

// Reads a list of `count` numbers. `what` names the entry in the message.
template <class Number, std::size_t count>
std::array<Number, count> ReadNumbers(const Json& json, const std::string& what) {
  // No level has as many vertices. Much larger integers would be truncated by the conversion.
  constexpr int kLimit = 1'000'000;
  const auto is_number = [](const Json& entry) {
    return std::is_integral_v<Number>
               ? entry.is_number_integer() && entry >= -kLimit && entry <= kLimit
               : entry.is_number();
  };
  if (!json.is_array() || json.size() != count ||
      !std::all_of(json.begin(), json.end(), is_number)) {
    throw InputError(
        fmt::format("{} is {}; it must be a list of {} {}", what, json.dump(), count,
                    std::is_integral_v<Number> ? "integers below a million" : "numbers"));
  }
  return json.get<std::array<Number, count>>();
}

TemplateFeature ParseFeature(const Json& json) {
  TemplateFeature feature{.name = json.at("name").get<std::string>(), .vertices = {}, .region = {}};
  const std::string what = fmt::format("feature '{}': ", feature.name);
  for (const Json& vertex : json.at("vertices")) {
    const auto [level, i, j] = ReadNumbers<int, 3>(vertex, what + "a vertex (level, i, j)");
    feature.vertices.push_back({level, i, j});
  }
  if (json.contains("region")) {
    const Json& region = json.at("region");
    const auto [x, y, z] = ReadNumbers<double, 3>(region.at("center"), what + "center");
    feature.region = Sphere{{x, y, z}, region.at("radius_mm").get<double>()};
  }
  return feature;
}

void CheckFormat(const Json& json) {
  if (json.at("format") != kFormat || json.at("version") != kVersion) {
    throw InputError(fmt::format("format and version are {} and {}; they must be \"{}\" and {}",
                                 json.at("format").dump(), json.at("version").dump(), kFormat,
                                 kVersion));
  }
}

std::vector<TemplateFeature> ParseFeatures(const Json& json) {
  CheckFormat(json);
  std::vector<TemplateFeature> features;
  for (const Json& feature : json.at("features")) {
    features.push_back(ParseFeature(feature));
  }
  return features;
}

std::map<std::string, Vec2> ParseSites(const std::string& text, const std::filesystem::path& path) {
  CsvReader csv(text, path.string());
  const std::size_t site = csv.RequireColumn("site"), u = csv.RequireColumn("u"),
                    v = csv.RequireColumn("v");
  std::map<std::string, Vec2> sites;
  while (csv.NextRow()) {
    const std::string code(csv.Cell(site));
    if (!sites.emplace(code, Vec2(csv.Number(u), csv.Number(v))).second) {
      csv.Fail(fmt::format("site '{}' appears twice; keep one", code));
    }
  }
  return sites;
}

// Adds the file's path in front of the messages of `action`.
template <class Action>
void NamingFile(const std::filesystem::path& path, const Action& action) {
  try {
    action();
  } catch (const nlohmann::json::exception& error) {
    throw InputError(
        fmt::format("{}: not a file of features: {}", path.string(), JsonFault(error)));
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", path.string(), error.what()));
  }
}

void CheckNamed(const FileTemplate& files) {
  if (files.surface.empty() || files.sites.empty()) {
    throw InputError(fmt::format(
        "template.{}: no file is named; give surface, sites and features as `semblance template` "
        "writes them, or `template: formula`",
        files.surface.empty() ? "surface" : "sites"));
  }
}

struct TemplateTexts {
  std::string surface, sites, features;  // contents of the files; `features` may be empty
};

// names: the messages call the texts by these.
TemplateFace ParseTemplate(const FileTemplate& names, const TemplateTexts& texts) {
  TemplateFace face{.surface = HSplineFromJson(texts.surface, names.surface.string()),
                    .site_uv = ParseSites(texts.sites, names.sites),
                    .features = {}};
  NamingFile(names.sites, [&] { CheckSites(face); });
  if (!names.features.empty()) {
    NamingFile(names.features, [&] {
      face.features = ParseFeatures(ParseJson(texts.features, names.features.string()));
      CheckFeatures(face);
    });
  }
  return face;
}

}  // namespace

FileTemplate WriteTemplate(const std::filesystem::path& folder, const TemplateFace& face) {
  NamingFile(folder, [&] {
    CheckSites(face);
    CheckFeatures(face);
  });
  FileTemplate files{.surface = folder / "head.hspline.json",
                     .sites = folder / "sites.csv",
                     .features = folder / "features.json"};
  WriteHSpline(files.surface, face.surface);
  WriteFileAtomically(files.sites, SitesText(face));
  WriteFileAtomically(files.features, FeaturesText(face));
  return files;
}

TemplateFace ReadTemplate(const FileTemplate& files) {
  CheckNamed(files);
  return ParseTemplate(files,
                       {.surface = ReadFileBytes(files.surface),
                        .sites = ReadFileBytes(files.sites),
                        .features = files.features.empty() ? "" : ReadFileBytes(files.features)});
}

namespace {

TemplateFace Load(const FormulaTemplate& source) { return MakeTemplateFace(source); }
TemplateFace Load(const FileTemplate& source) { return ReadTemplate(source); }
TemplateFace ParseIct(std::string_view surface) {
  return ParseTemplate({"the ICT face", "the ICT face's sites", "the ICT face's features"},
                       {std::string(surface), std::string(IctSites()), std::string(IctFeatures())});
}

TemplateFace Load(const IctTemplate& source) {
  static const TemplateFace kModel = ParseIct(IctSurface());
  static const TemplateFace kPeople = ParseIct(PeopleSurface());
  return source.mean == IctMean::kModel ? kModel : kPeople;
}

}  // namespace

TemplateFace LoadTemplate(const TemplateSource& source) {
  return std::visit([](const auto& given) { return Load(given); }, source);
}

std::vector<std::filesystem::path> TemplateFiles(const TemplateSource& source) {
  std::vector<std::filesystem::path> named;
  if (const auto* const files = std::get_if<FileTemplate>(&source)) {
    named = {files->surface, files->sites, files->features};
    std::erase(named, std::filesystem::path());
  }
  return named;
}

}  // namespace semblance::problems
