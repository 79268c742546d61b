// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face_template/template_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>

#include "problems/output/files.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/hspline_json.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "semblance template";
constexpr int kVersion = 1;

// ---------------------------------------------------------------------------------------------
// What a template must be
// ---------------------------------------------------------------------------------------------

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

std::filesystem::path SurfaceName(const std::filesystem::path& path) {
  return path.stem().string() + ".hspline.json";
}

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

Json ToJson(const TemplateFace& face, const std::string& surface_name) {
  Json sites = Json::object();
  for (const auto& [code, uv] : face.site_uv) {
    sites[code] = {uv.x(), uv.y()};
  }
  Json features = Json::array();
  for (const TemplateFeature& feature : face.features) {
    features.push_back(ToJson(feature));
  }
  return {{"format", kFormat},
          {"version", kVersion},
          {"surface", surface_name},
          {"site_uv", std::move(sites)},
          {"features", std::move(features)}};
}

// ---------------------------------------------------------------------------------------------
// Reading
// ---------------------------------------------------------------------------------------------

// `what` names the entry in the message.
template <class Number, std::size_t count>
std::array<Number, count> Numbers(const Json& json, const std::string& what) {
  const auto is_number = [](const Json& entry) {
    return std::is_integral_v<Number> ? entry.is_number_integer() : entry.is_number();
  };
  if (!json.is_array() || json.size() != count ||
      !std::all_of(json.begin(), json.end(), is_number)) {
    throw InputError(fmt::format("{} is {}; it must be a list of {} {}", what, json.dump(), count,
                                 std::is_integral_v<Number> ? "integers" : "numbers"));
  }
  return json.get<std::array<Number, count>>();
}

TemplateFeature FeatureFrom(const Json& json) {
  TemplateFeature feature{.name = json.at("name").get<std::string>(), .vertices = {}, .region = {}};
  const std::string what = fmt::format("feature '{}': ", feature.name);
  for (const Json& vertex : json.at("vertices")) {
    const auto [level, i, j] = Numbers<int, 3>(vertex, what + "a vertex (level, i, j)");
    feature.vertices.push_back({level, i, j});
  }
  if (json.contains("region")) {
    const Json& region = json.at("region");
    const auto [x, y, z] = Numbers<double, 3>(region.at("center"), what + "center");
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

// All but the surface.
TemplateFace FaceFrom(const Json& json, HSplineSurface surface) {
  TemplateFace face{.surface = std::move(surface), .site_uv = {}, .features = {}};
  for (const auto& [code, uv] : json.at("site_uv").items()) {
    const auto [u, v] = Numbers<double, 2>(uv, fmt::format("site '{}'", code));
    face.site_uv[code] = {u, v};
  }
  for (const Json& feature : json.at("features")) {
    face.features.push_back(FeatureFrom(feature));
  }
  CheckSites(face);
  CheckFeatures(face);
  return face;
}

std::filesystem::path SurfacePath(const std::filesystem::path& path, const Json& json) {
  return path.parent_path() / json.at("surface").get<std::string>();
}

// What parse(json) makes of the file. Faults are told in one line that starts with its path.
template <class Parse>
auto ReadJson(const std::filesystem::path& path, const Parse& parse) {
  const std::string text = ReadFileBytes(path);
  try {
    const Json json = Json::parse(text);
    CheckFormat(json);
    return parse(json);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(fmt::format("{}: not a template file: {}", path.string(), error.what()));
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", path.string(), error.what()));
  }
}

}  // namespace

void WriteTemplate(const std::filesystem::path& path, const TemplateFace& face) {
  try {
    CheckSites(face);
    CheckFeatures(face);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: not written: {}", path.string(), error.what()));
  }
  const std::filesystem::path surface = SurfaceName(path);
  WriteFileAtomically(path.parent_path() / surface, HSplineToJson(face.surface));
  WriteFileAtomically(path, ToJson(face, surface.string()).dump(1) + "\n");
}

TemplateFace ReadTemplate(const std::filesystem::path& path) {
  return ReadJson(path, [&](const Json& json) {
    const std::filesystem::path surface = SurfacePath(path, json);
    return FaceFrom(json, HSplineFromJson(ReadFileBytes(surface), surface.string()));
  });
}

std::filesystem::path SurfaceFileOf(const std::filesystem::path& path) {
  return ReadJson(path, [&](const Json& json) { return SurfacePath(path, json); });
}

}  // namespace semblance
