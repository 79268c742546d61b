// SPDX-License-Identifier: GPL-3.0-or-later
// Facial features (thesis 4.3): named sets of offsets that are taken from one face and applied to
// another.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance::surfaces {

struct Feature {
  std::string name;                  // letters, digits, '-', '_'; also the file's name in a library
  HSplineShape shape;                // shape of the source surface
  std::map<VertexId, Vec3> offsets;  // as in HSplineSurface::Offsets

  bool operator==(const Feature&) const = default;
};

// A rectangle of the domain and a range of levels. If lowest_u > highest_u the region crosses the
// seam of u; the same holds for v if v is closed.
struct FeatureRegion {
  double lowest_u = 0, highest_u = 1;
  double lowest_v = 0, highest_v = 1;
  int first_level = 1, last_level = 8;
};

// Throws InputError unless the name consists of letters, digits, '-' and '_', at least one.
void CheckFeatureName(const std::string& name);

// Takes the offsets of the vertices whose Greville points lie in the region. Throws InputError for
// an invalid name.
Feature ExtractFeature(const HSplineSurface& surface, std::string name,
                       const FeatureRegion& region = {});

// Takes the offsets of the given vertices. Vertices without an offset are omitted.
Feature ExtractFeature(const HSplineSurface& surface, std::string name,
                       std::span<const VertexId> vertices);

// Sets the feature's offsets and keeps all others. Throws InputError, and leaves the surface
// unchanged, if the source surface had other patches, closure or offset reference, or the feature
// has vertices of a level that the surface lacks.
void ApplyFeature(const Feature& feature, HSplineSurface& surface);

// Applies the feature and removes the offsets of all other `vertices`, which undoes their change by
// a fit (thesis 4.3).
void RestoreFeature(const Feature& feature, std::span<const VertexId> vertices,
                    HSplineSurface& surface);

struct FeatureBlend {
  Feature feature;
  std::vector<std::string> warnings;  // one per weight outside 0..1, which extrapolates
};

// The weighted sum of the features' offsets. A vertex missing from a feature counts as offset 0
// there, and a feature of weight 0 counts as absent. weights: one per feature, finite. Throws
// InputError if there is no feature or the features do not fit each other.
FeatureBlend BlendFeatures(std::string name, std::span<const Feature> features,
                           std::span<const double> weights);

// The feature mirrored to the other side, (u,v) -> (1 - u, v) and x -> -x. Exact for surfaces whose
// coarser levels are symmetric about x = 0.
Feature MirrorFeature(const Feature& feature);

}  // namespace semblance::surfaces
