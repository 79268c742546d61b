// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_files/feature.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"
#include "surfaces/hspline_files/json_parts.h"

namespace semblance {
namespace {

constexpr std::string_view kFeatureFormat = "semblance-feature";
constexpr int kFeatureVersion = 1;

void CheckName(const std::string& name) {
  const auto allowed = [](unsigned char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_';
  };
  if (name.empty() || !std::all_of(name.begin(), name.end(), allowed)) {
    throw InputError(fmt::format(
        "feature: '{}' is not a name; use letters, digits, '-' and '_', at least one", name));
  }
}

bool Holds(double lowest, double highest, double x) {
  return lowest <= highest ? x >= lowest && x <= highest : x >= lowest || x <= highest;
}

std::string ShapeInWords(const HSplineShape& shape) {
  return fmt::format("{} x {} patches, {}, offsets in {}", shape.patches_u, shape.patches_v,
                     EnumNames(shape.closure)[static_cast<int>(shape.closure)],
                     EnumNames(shape.reference)[static_cast<int>(shape.reference)]);
}

void CheckFits(const Feature& feature, const HSplineShape& shape, const std::string& what) {
  HSplineShape same = feature.shape;
  same.max_level = shape.max_level;
  if (same != shape) {
    throw InputError(fmt::format(
        "feature {}: it is of a surface of {}, {} is of {}; use features of the same template",
        feature.name, ShapeInWords(feature.shape), what, ShapeInWords(shape)));
  }
}

void CheckVertices(const Feature& feature) {
  const HSplineShape& shape = feature.shape;
  for (const auto& [vertex, offset] : feature.offsets) {
    if (vertex.level < 1 || vertex.level > std::min(shape.max_level, 8) || vertex.i < 0 ||
        vertex.i >= shape.Columns(vertex.level) || vertex.j < 0 ||
        vertex.j >= shape.Rows(vertex.level) || !offset.allFinite()) {
      throw IoError(fmt::format("there is no vertex ({}, {}) with an offset on level {}", vertex.i,
                                vertex.j, vertex.level));
    }
  }
}

Feature ParsedFeature(const json_parts::Json& json) {
  json_parts::RequireKeys(json, {"format", "version", "name", "units", "patches", "max_level",
                                 "closure", "offset_reference", "offsets"});
  json_parts::RequireFormat(json, kFeatureFormat, kFeatureVersion);
  Feature feature;
  feature.name = json.at("name").get<std::string>();
  feature.shape = json_parts::ShapeFromJson(json);
  feature.offsets = json_parts::OffsetsFromJson(json);
  CheckName(feature.name);
  CheckVertices(feature);
  return feature;
}

// One outside 0..1 is noted.
void CheckWeight(const Feature& feature, double weight, std::vector<std::string>& warnings) {
  if (!std::isfinite(weight)) {
    throw InputError(
        fmt::format("feature {}: its weight {} is not finite; use 0..1", feature.name, weight));
  }
  if (weight < 0 || weight > 1) {
    warnings.push_back(fmt::format(
        "feature {}: the weight {} is outside 0..1, so the blend goes beyond what was measured",
        feature.name, weight));
  }
}

void AddWeighted(const Feature& feature, double weight, Feature& sum) {
  sum.shape.max_level = std::max(sum.shape.max_level, feature.shape.max_level);
  for (const auto& [vertex, offset] : feature.offsets) {
    const Vec3 part = weight * offset;
    const auto [entry, is_new] = sum.offsets.emplace(vertex, part);
    if (!is_new) {
      entry->second += part;
    }
  }
}

void CheckOffsets(const Feature& blend) {
  for (const auto& [vertex, offset] : blend.offsets) {
    if (!offset.allFinite()) {
      throw InputError(
          fmt::format("feature {}: with these weights the offset of vertex ({}, {}) of level {} is "
                      "not a finite "
                      "number; use weights about 0..1",
                      blend.name, vertex.i, vertex.j, vertex.level));
    }
  }
}

}  // namespace

Feature ExtractFeature(const HSplineSurface& surface, std::string name,
                       const FeatureRegion& region) {
  CheckName(name);
  Feature feature{std::move(name), surface.shape(), {}};
  for (const auto& [vertex, offset] : surface.Offsets()) {
    const Vec2 uv = surface.ParameterOf(vertex);
    if (vertex.level >= region.first_level && vertex.level <= region.last_level &&
        Holds(region.lowest_u, region.highest_u, uv.x()) && uv.y() >= region.lowest_v &&
        uv.y() <= region.highest_v) {
      feature.offsets.emplace(vertex, offset);
    }
  }
  return feature;
}

Feature ExtractFeature(const HSplineSurface& surface, std::string name,
                       std::span<const VertexId> vertices) {
  CheckName(name);
  Feature feature{std::move(name), surface.shape(), {}};
  for (const VertexId& vertex : vertices) {
    if (const std::optional<Vec3> offset = surface.Offset(vertex)) {
      feature.offsets.emplace(vertex, *offset);
    }
  }
  return feature;
}

void ApplyFeature(const Feature& feature, HSplineSurface& surface) {
  RestoreFeature(feature, {}, surface);
}

void RestoreFeature(const Feature& feature, std::span<const VertexId> vertices,
                    HSplineSurface& surface) {
  CheckFits(feature, surface.shape(), "the face");
  std::map<VertexId, std::optional<Vec3>> offsets(feature.offsets.begin(), feature.offsets.end());
  for (const VertexId& vertex : vertices) {
    offsets.emplace(vertex, std::nullopt);
  }
  surface.SetOffsets(offsets);
}

Feature ReadFeature(const std::filesystem::path& path) {
  return FeatureFromJson(ReadFileBytes(path), path.string());
}

FeatureBlend BlendFeatures(std::string name, std::span<const Feature> features,
                           std::span<const double> weights) {
  CheckName(name);
  if (features.empty() || features.size() != weights.size()) {
    throw InputError(fmt::format(
        "feature {}: {} features and {} weights; at least one feature and one weight for each are "
        "needed",
        name, features.size(), weights.size()));
  }
  FeatureBlend blend{{std::move(name), features[0].shape, {}}, {}};
  for (std::size_t k = 0; k < features.size(); ++k) {
    CheckFits(features[k], blend.feature.shape, fmt::format("feature {}", features[0].name));
    CheckWeight(features[k], weights[k], blend.warnings);
    if (weights[k] != 0) {
      AddWeighted(features[k], weights[k], blend.feature);
    }
  }
  CheckOffsets(blend.feature);
  return blend;
}

Feature MirrorFeature(const Feature& feature) {
  const HSplineShape& shape = feature.shape;
  Feature mirrored{feature.name, shape, {}};
  for (const auto& [vertex, offset] : feature.offsets) {
    const int knot = shape.PatchesU(vertex.level) + 2 - vertex.i;  // of 1 - u
    const int i = shape.ClosedU() ? knot % shape.Columns(vertex.level) : knot;
    // In the mirrored frame the u-tangent runs the other way, the two other axes are the mirrored
    // ones: there too only the first component turns round.
    mirrored.offsets.emplace(VertexId{vertex.level, i, vertex.j},
                             Vec3(-offset.x(), offset.y(), offset.z()));
  }
  return mirrored;
}

std::string FeatureToJson(const Feature& feature) {
  json_parts::Json json;
  json["format"] = kFeatureFormat;
  json["version"] = kFeatureVersion;
  json["name"] = feature.name;
  json["units"] = "mm";
  json_parts::ShapeToJson(feature.shape, json);
  json["offsets"] = json_parts::OffsetsToJson(feature.offsets);
  return json.dump() + "\n";
}

Feature FeatureFromJson(std::string_view text, const std::string& source) {
  try {
    return ParsedFeature(json_parts::ParseWithoutRepeats(text));
  } catch (const nlohmann::json::exception& e) {
    throw IoError(fmt::format("{}: not a feature that can be read: {}", source, JsonFault(e)));
  } catch (const Error& e) {
    throw IoError(fmt::format("{}: not a feature that can be read: {}", source, e.what()));
  }
}

std::filesystem::path StoreFeature(const std::filesystem::path& folder, const Feature& feature) {
  CheckName(feature.name);
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw IoError(
        fmt::format("{}: the folder cannot be created: {}", folder.string(), error.message()));
  }
  const std::filesystem::path path = folder / fmt::format("{}.json", feature.name);
  WriteFileAtomically(path, FeatureToJson(feature));
  return path;
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
    throw IoError(
        fmt::format("{}: no library that can be read: {}", folder.string(), error.message()));
  }
  return library;
}

}  // namespace semblance
