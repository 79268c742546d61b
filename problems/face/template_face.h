// SPDX-License-Identifier: GPL-3.0-or-later
// The generic face of the H-spline method (thesis 4.2, 4.3): a surface, the (u,v) at which the
// dowels meet it, and its features.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::problems {

struct FormulaTemplate {
  static constexpr std::string_view kName = "formula";
  int patches_u = 8;
  int patches_v = 8;
  int max_level = 3;
  double detail_tolerance_mm = 0.1;
  OffsetReference reference = OffsetReference::kFrame;
  double site_error = 0;
  std::uint64_t site_random_seed = 1;
};

template <class Visitor>
void Fields(Visitor& visit, FormulaTemplate& o) {
  visit(FieldInfo{.name = "patches_u",
                  .min = 4,
                  .max = 16,
                  .doc = "patches of level 0 from ear to ear; more of them follow the dowels more "
                         "closely and need more dowels"},
        o.patches_u);
  visit(FieldInfo{.name = "patches_v",
                  .min = 4,
                  .max = 16,
                  .doc = "patches of level 0 from throat to crown"},
        o.patches_v);
  visit(FieldInfo{.name = "max_level",
                  .min = 0,
                  .max = 4,
                  .doc = "finest level of detail; 3 keeps eyes, nose and mouth; the published "
                         "schedule fits levels 0 to 2 (thesis 4.2)"},
        o.max_level);
  visit(FieldInfo{.name = "detail_tolerance_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 10,
                  .doc = "a level stores an offset only where it moves a control vertex by more; "
                         "larger is sparser and less exact"},
        o.detail_tolerance_mm);
  visit(
      FieldInfo{.name = "reference",
                .doc = "axes in which detail is kept; frame: those of the next coarser surface, "
                       "so that detail turns with it (thesis 4.1); world: fixed axes, to compare"},
      o.reference);
  visit(FieldInfo{.name = "site_error",
                  .min = 0,
                  .max = 0.2,
                  .doc = "largest random error of each site's (u,v), as a part of the domain; it "
                         "shows how relaxation handles sites that are only roughly right"},
        o.site_error);
  visit(FieldInfo{.name = "site_random_seed", .doc = "random seed of those errors"},
        o.site_random_seed);
}

// A part of the face whose detail a fit may release and then restore (thesis 4.3).
struct TemplateFeature {
  std::string name;                // nose, mouth, eye_l, eye_r
  std::vector<VertexId> vertices;  // of levels >= 1, sorted
  std::optional<Sphere> region;    // no dowels are seeded in it; in the template's frame, mm
};

struct TemplateFace {
  HSplineSurface surface;               // LPS, mm, nasion near the origin, normals outward
  std::map<std::string, Vec2> site_uv;  // by site code, e.g. "g", "zy_l"
  std::vector<TemplateFeature> features;
};

// The generic face by formula (HeadPoint) as an H-spline. Level 0 is its least-squares fit. Each
// finer level adds offsets where its own least-squares fit differs. The face is mirror symmetric:
// (u,v) -> (1-u,v) is x -> -x. It has all 32 sites and the features nose, mouth, eye_l and eye_r.
// Throws InputError if an option is out of range.
TemplateFace MakeTemplateFace(const FormulaTemplate& options);

// The features nose, mouth, eye_l and eye_r of a surface over the formula's own (u,v) and in its
// frame. The surface may have more levels than FormulaTemplate makes.
std::vector<TemplateFeature> GenericHeadFeatures(const HSplineSurface& surface);

// The vertices of all features, each once and sorted. A fit restores them.
std::vector<VertexId> FeatureVertices(const TemplateFace& face);

// The regions of the features, in the frame of the template. Seeding leaves them out.
std::vector<Sphere> TemplateMasks(const TemplateFace& face);

// The image of a sphere under a similarity.
Sphere TransformedSphere(const Sphere& sphere, const Similarity& to_from);

}  // namespace semblance::problems
