// SPDX-License-Identifier: GPL-3.0-or-later
// Facial features (thesis 4.3): named sets of offsets, taken from one face and given to another.
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

struct Feature {
  std::string name;    // letters, digits, '-' and '_'; also the file's name in a library
  HSplineShape shape;  // of the surface that it was taken from
  std::map<VertexId, Vec3> offsets;  // as HSplineSurface::Offsets

  bool operator==(const Feature&) const = default;
};

// A part of the domain and of the levels. With lowest > highest u it runs across the seam.
struct FeatureRegion {
  double lowest_u = 0, highest_u = 1;
  double lowest_v = 0, highest_v = 1;
  int first_level = 1, last_level = 8;
};

// The offsets of the surface's vertices in the region. Throws InputError for an invalid name.
Feature ExtractFeature(const HSplineSurface& surface, std::string name,
                       const FeatureRegion& region = {});

// The offsets of these vertices; those without one are not in the feature.
Feature ExtractFeature(const HSplineSurface& surface, std::string name,
                       std::span<const VertexId> vertices);

// Gives the feature's offsets to its vertices; all others keep theirs. Throws InputError if the
// feature was taken from a surface of other patches, closure or offset reference, or has vertices
// of a level that the surface has not; the surface is then as before.
void ApplyFeature(const Feature& feature, HSplineSurface& surface);

// The same; also, those of `vertices` that are not in the feature lose their offsets: what a fit
// did to them is undone (thesis 4.3).
void RestoreFeature(const Feature& feature, std::span<const VertexId> vertices,
                    HSplineSurface& surface);

// Reads the file of one feature. Throws IoError.
Feature ReadFeature(const std::filesystem::path& path);

struct FeatureBlend {
  Feature feature;
  std::vector<std::string> warnings;  // one per weight outside 0..1: it extrapolates
};

// The weighted sum of the features' offsets. A vertex that is not in a feature counts as offset 0
// there; a feature of weight 0 counts as absent. weights: one per feature, finite. Throws
// InputError if there is no feature or they do not fit each other.
FeatureBlend BlendFeatures(std::string name, std::span<const Feature> features,
                           std::span<const double> weights);

// The feature on the other side: at (1 - u, v), with x negated. Exact for surfaces whose
// coarser levels are symmetric about x = 0.
Feature MirrorFeature(const Feature& feature);

// {"format": "semblance-feature", "version": 1, "name": ..., "units": "mm", "patches": [u, v],
// "max_level": L, "closure": ..., "offset_reference": ..., "offsets": [[level, i, j, x, y, z],
// ...]}; numbers round-trip to the bit. `source`: what errors call the text. Throws IoError for
// anything else.
std::string FeatureToJson(const Feature& feature);
Feature FeatureFromJson(std::string_view text, const std::string& source);

// Writes folder / (name + ".json"); the folder is created. Returns the path. Throws IoError.
std::filesystem::path StoreFeature(const std::filesystem::path& folder, const Feature& feature);

// All features of a library folder (its .json files), by name. Throws IoError if there is no such
// folder, a file cannot be read or does not bear its feature's name.
std::map<std::string, Feature> ReadFeatureLibrary(const std::filesystem::path& folder);

}  // namespace semblance
