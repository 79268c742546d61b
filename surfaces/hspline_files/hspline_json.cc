// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_files/hspline_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"

namespace semblance::surfaces {
namespace {

using namespace json_parts;

constexpr std::string_view kHSplineFormat = "semblance-hspline";
constexpr int kHSplineVersion = 1;

constexpr std::string_view kFeatureFormat = "semblance-feature";
constexpr int kFeatureVersion = 1;

template <class Enum>
Enum EnumFromName(const std::string& name) {
  const auto names = EnumNames(Enum{});
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    throw IoError(fmt::format("'{}' is not one of {}", name, fmt::join(names, ", ")));
  }
  return static_cast<Enum>(found - names.begin());
}

HSplineShape ShapeFromJson(const Json& json) {
  RequireSize(json.at("patches"), 2);
  HSplineShape shape;
  shape.patches_u = IntFromJson(json.at("patches")[0]);
  shape.patches_v = IntFromJson(json.at("patches")[1]);
  shape.max_level = IntFromJson(json.at("max_level"));
  shape.closure = EnumFromName<Closure>(json.at("closure").get<std::string>());
  shape.reference = EnumFromName<OffsetReference>(json.at("offset_reference").get<std::string>());
  return shape;
}

void ShapeToJson(const HSplineShape& shape, Json& json) {
  json["patches"] = {shape.patches_u, shape.patches_v};
  json["max_level"] = shape.max_level;
  json["closure"] = EnumNames(shape.closure)[static_cast<int>(shape.closure)];
  json["offset_reference"] = EnumNames(shape.reference)[static_cast<int>(shape.reference)];
}

std::map<VertexId, Vec3> OffsetsFromJson(const Json& json) {
  std::map<VertexId, Vec3> offsets;
  for (const Json& row : ListFromJson(json, "offsets")) {
    RequireSize(row, 6);
    const VertexId vertex{IntFromJson(row[0]), IntFromJson(row[1]), IntFromJson(row[2])};
    if (!offsets.emplace(vertex, VecFromJson(row, 3)).second) {
      throw IoError(fmt::format("vertex ({}, {}) of level {} has two offsets", vertex.i, vertex.j,
                                vertex.level));
    }
  }
  return offsets;
}

Json OffsetsToJson(const std::map<VertexId, Vec3>& offsets) {
  Json rows = Json::array();
  for (const auto& [vertex, o] : offsets) {
    rows.push_back({vertex.level, vertex.i, vertex.j, o.x(), o.y(), o.z()});
  }
  return rows;
}

HSplineSurface SurfaceFromJson(const Json& json) {
  RequireKeys(json, {"format", "version", "patches", "max_level", "closure", "offset_reference",
                     "units", "level0", "offsets"});
  RequireFormat(json, kHSplineFormat, kHSplineVersion);
  const HSplineShape shape = ShapeFromJson(json);
  ControlNet net{shape.Columns(0), shape.Rows(0), {}};
  for (const Json& row : ListFromJson(json, "level0")) {
    RequireSize(row, 3);
    net.vertices.push_back(VecFromJson(row, 0));
  }
  std::map<VertexId, std::optional<Vec3>> offsets;
  for (const auto& [vertex, offset] : OffsetsFromJson(json)) {
    offsets.emplace(vertex, offset);
  }
  HSplineSurface surface(shape, std::move(net));
  surface.SetOffsets(offsets);
  return surface;
}

void CheckVertices(const Feature& feature) {
  const HSplineShape& shape = feature.shape;
  for (const auto& [vertex, offset] : feature.offsets) {
    if (vertex.level < 1 || vertex.level > std::min(shape.max_level, 8) || vertex.i < 0 ||
        vertex.i >= shape.Columns(vertex.level) || vertex.j < 0 ||
        vertex.j >= shape.Rows(vertex.level) || !offset.allFinite()) {
      throw IoError(fmt::format("there is no vertex ({}, {}) with a finite offset on level {}",
                                vertex.i, vertex.j, vertex.level));
    }
  }
}

Feature ParsedFeature(const Json& json) {
  RequireKeys(json, {"format", "version", "name", "units", "patches", "max_level", "closure",
                     "offset_reference", "offsets"});
  RequireFormat(json, kFeatureFormat, kFeatureVersion);
  Feature feature;
  feature.name = json.at("name").get<std::string>();
  feature.shape = ShapeFromJson(json);
  feature.offsets = OffsetsFromJson(json);
  CheckFeatureName(feature.name);
  CheckVertices(feature);
  return feature;
}

}  // namespace

void CheckFinite(const HSplineSurface& surface) {
  const ControlNet level0 = surface.Net(0);
  bool finite = std::ranges::all_of(level0.vertices, [](const Vec3& p) { return p.allFinite(); });
  for (const auto& [vertex, offset] : surface.Offsets()) {
    finite = finite && offset.allFinite();
  }
  if (!finite) {
    throw InputError(
        "H-spline: a vertex is not finite, so the surface cannot be written; look for huge numbers "
        "in its input");
  }
}

std::string HSplineToJson(const HSplineSurface& surface) {
  CheckFinite(surface);
  const HSplineShape& shape = surface.shape();
  Json json;
  json["format"] = kHSplineFormat;
  json["version"] = kHSplineVersion;
  json["units"] = "mm";
  ShapeToJson(shape, json);
  json["level0"] = Json::array();
  const ControlNet level0 = surface.Net(0);
  for (const Vec3& p : level0.vertices) {
    json["level0"].push_back({p.x(), p.y(), p.z()});
  }
  json["offsets"] = OffsetsToJson(surface.Offsets());
  return json.dump() + "\n";
}

HSplineSurface HSplineFromJson(std::string_view text, const std::string& name) {
  const std::size_t start = text.find_first_not_of(" \t\r\n");
  if (start == text.npos || text[start] != '{') {
    throw IoError(
        fmt::format("{}: not an H-spline: this is not a JSON object; an H-spline is a file such as "
                    "face.hspline.json of a run, or surface.hspline.json of a fit",
                    name));
  }
  try {
    return SurfaceFromJson(ParseWithoutRepeats(text));
  } catch (const nlohmann::json::exception& e) {
    throw IoError(fmt::format("{}: not a readable H-spline: {}", name, JsonFault(e)));
  } catch (const Error& e) {
    throw IoError(fmt::format("{}: not a readable H-spline: {}", name, e.what()));
  }
}

void WriteHSpline(const std::filesystem::path& path, const HSplineSurface& surface) {
  WriteFileAtomically(path, HSplineToJson(surface));
}

HSplineSurface ReadHSpline(const std::filesystem::path& path) {
  return HSplineFromJson(ReadFileBytes(path), path.string());
}

std::string FeatureToJson(const Feature& feature) {
  Json json;
  json["format"] = kFeatureFormat;
  json["version"] = kFeatureVersion;
  json["name"] = feature.name;
  json["units"] = "mm";
  ShapeToJson(feature.shape, json);
  json["offsets"] = OffsetsToJson(feature.offsets);
  return json.dump() + "\n";
}

Feature FeatureFromJson(std::string_view text, const std::string& source) {
  try {
    return ParsedFeature(ParseWithoutRepeats(text));
  } catch (const nlohmann::json::exception& e) {
    throw IoError(fmt::format("{}: not a readable feature: {}", source, JsonFault(e)));
  } catch (const Error& e) {
    throw IoError(fmt::format("{}: not a readable feature: {}", source, e.what()));
  }
}

std::filesystem::path StoreFeature(const std::filesystem::path& folder, const Feature& feature) {
  CheckFeatureName(feature.name);
  const std::filesystem::path path = folder / fmt::format("{}.json", feature.name);
  NewFolders made(folder);
  WriteFileAtomically(path, FeatureToJson(feature));
  made.Keep();
  return path;
}

Feature ReadFeature(const std::filesystem::path& path) {
  return FeatureFromJson(ReadFileBytes(path), path.string());
}

std::map<std::string, Feature> ReadFeatureLibrary(const std::filesystem::path& folder) {
  std::error_code error;
  std::map<std::string, Feature> library;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::filesystem::path& path = entry.path();
    if (path.extension() != ".json") {
      continue;
    }
    Feature feature = ReadFeature(path);
    if (feature.name != path.stem()) {
      throw IoError(fmt::format("{}: it holds the feature {}; name the file {}.json", path.string(),
                                feature.name, feature.name));
    }
    library.emplace(feature.name, std::move(feature));
  }
  if (error) {
    throw IoError(fmt::format("{}: not a readable library: {}", folder.string(), error.message()));
  }
  return library;
}

}  // namespace semblance::surfaces
