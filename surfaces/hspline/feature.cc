// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/feature.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "surfaces/base/error.h"

namespace semblance::surfaces {
namespace {

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

// Adds a warning for a weight outside 0..1.
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

void CheckFeatureName(const std::string& name) {
  const auto allowed = [](unsigned char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_';
  };
  if (name.empty() || !std::all_of(name.begin(), name.end(), allowed)) {
    throw InputError(fmt::format(
        "feature: '{}' is not a name; use letters, digits, '-' and '_', at least one", name));
  }
}

Feature ExtractFeature(const HSplineSurface& surface, std::string name,
                       const FeatureRegion& region) {
  CheckFeatureName(name);
  Feature feature{std::move(name), surface.shape(), {}};
  for (const auto& [vertex, offset] : surface.Offsets()) {
    const Vec2 uv = surface.GrevillePoint(vertex);
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
  CheckFeatureName(name);
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

FeatureBlend BlendFeatures(std::string name, std::span<const Feature> features,
                           std::span<const double> weights) {
  CheckFeatureName(name);
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
    const int knot = shape.PatchesU(vertex.level) + 2 - vertex.i;  // knot of 1 - u
    const int i = shape.ClosedU() ? knot % shape.Columns(vertex.level) : knot;
    // Mirroring reverses the frame's u-tangent and mirrors its two other axes. Hence the first
    // component of the offset changes its sign, and the others stay.
    mirrored.offsets.emplace(VertexId{vertex.level, i, vertex.j},
                             Vec3(-offset.x(), offset.y(), offset.z()));
  }
  return mirrored;
}

}  // namespace semblance::surfaces
