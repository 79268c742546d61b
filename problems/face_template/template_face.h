// SPDX-License-Identifier: GPL-3.0-or-later
// The generic face of the H-spline method (thesis 4.2, 4.3): a surface, where the dowels meet it,
// and its features.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

struct FormulaTemplate {
  static constexpr std::string_view kName = "formula";
  int patches_u = 8;                 // of level 0, from ear to ear
  int patches_v = 8;                 // of level 0, from throat to crown
  int max_level = 3;                 // finest level that holds detail
  double detail_tolerance_mm = 0.1;  // a level keeps a vertex that moves by more than this
  OffsetReference reference = OffsetReference::kFrame;  // world: detail does not turn with the face
  double site_error = 0;                                // part of the domain
  std::uint64_t site_random_seed = 1;                   // of the errors
};

template <class Visitor>
void Fields(Visitor& visit, FormulaTemplate& o) {
  visit(FieldInfo{.name = "patches_u",
                  .min = 4,
                  .max = 16,
                  .doc = "patches of level 0 from ear to ear; more follow the dowels more closely "
                         "and need more of them"},
        o.patches_u);
  visit(FieldInfo{.name = "patches_v",
                  .min = 4,
                  .max = 16,
                  .doc = "patches of level 0 from throat to crown"},
        o.patches_v);
  visit(FieldInfo{.name = "max_level",
                  .min = 0,
                  .max = 4,
                  .doc = "finest level of detail; 3 keeps eyes, nose and mouth, of which the "
                         "published schedule fits levels 0 to 2 (thesis 4.2)"},
        o.max_level);
  visit(FieldInfo{.name = "detail_tolerance_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 10,
                  .doc = "a level stores an offset only where it moves a control vertex by more; "
                         "larger is sparser and less exact"},
        o.detail_tolerance_mm);
  visit(FieldInfo{.name = "reference",
                  .doc = "axes in which detail is kept; frame: of the next coarser surface, so "
                         "that detail turns with it (thesis 4.1); world: fixed, to compare"},
        o.reference);
  visit(FieldInfo{.name = "site_error",
                  .min = 0,
                  .max = 0.2,
                  .doc = "part of the domain by which each site's (u,v) is off, at random; to see "
                         "what relaxation makes of sites that are only about right"},
        o.site_error);
  visit(FieldInfo{.name = "site_random_seed", .doc = "which errors"}, o.site_random_seed);
}

// A part of the face whose detail a fit may free and then restore (thesis 4.3).
struct TemplateFeature {
  std::string name;                // nose, mouth, eye_l, eye_r
  std::vector<VertexId> vertices;  // of levels >= 1, sorted
  std::optional<Sphere> region;    // in the frame of the template, mm; where no dowels are seeded
};

struct TemplateFace {
  HSplineSurface surface;               // LPS, mm, nasion near the origin, normals outward
  std::map<std::string, Vec2> site_uv;  // by site code, e.g. "g", "zy_l"
  std::vector<TemplateFeature> features;
};

// The generic face by formula (HeadPoint) as an H-spline: level 0 is its least-squares fit, each
// finer level adds offsets where its own least-squares fit differs. Mirror symmetric, (u,v) ->
// (1-u,v) is x -> -x. All 32 sites; features nose, mouth, eye_l, eye_r. Throws InputError if an
// option is out of range.
TemplateFace MakeTemplateFace(const FormulaTemplate& options);

// nose, mouth, eye_l and eye_r of a surface over the formula's own (u,v) and in its frame, which
// may have more levels than FormulaTemplate makes.
std::vector<TemplateFeature> FeaturesOfGenericHead(const HSplineSurface& surface);

// The vertices of all features, each once, sorted: what a fit restores.
std::vector<VertexId> FeatureVertices(const TemplateFace& face);

// The regions of the features, for seeding, in the frame of the template.
std::vector<Sphere> TemplateMasks(const TemplateFace& face);

// The sphere that a similarity makes of a sphere.
Sphere Transformed(const Sphere& sphere, const Similarity& to_from);

}  // namespace semblance
