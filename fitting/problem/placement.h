// SPDX-License-Identifier: GPL-3.0-or-later
// Placement of the template over the subject before the fit.
#pragma once

#include <span>

#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

// The thesis (4.2) translates and scales the template by hand. We also rotate it, because skulls
// are scanned in any pose.
struct PlacementOptions {
  bool rotate = true;
  bool scale = true;
};
template <class Visitor>
void Fields(Visitor& visit, PlacementOptions& o) {
  visit(
      FieldInfo{.name = "rotate",
                .doc = "rotate the template onto the subject; false: only shift (and scale) it, as "
                       "in the thesis"},
      o.rotate);
  visit(FieldInfo{.name = "scale",
                  .doc = "scale the template to the subject's size, by one factor for all axes"},
        o.scale);
}

// Finds the similarity T = subject_from_template that minimises
//
//   sum_i weights_i |on_subject_i - T * on_template_i|^2
//
// (Umeyama 1991, with weights). Its rotation is proper, never a reflection. on_template and
// on_subject: n points each, mm; weights: n values > 0, or empty for equal weights. Throws
// InputError if the sizes disagree, if a value is not finite or a weight not positive, or if the
// points do not determine T: a shift needs 1 point, a scale 2 that differ, a rotation 3 that do not
// lie on a line.
Similarity PlaceTemplate(std::span<const Vec3> on_template, std::span<const Vec3> on_subject,
                         std::span<const double> weights = {},
                         const PlacementOptions& options = {});

// The surface under a similarity: Point(uv) of the result is to_from * Point(uv). The vertices of
// level 0 are mapped, and offsets are scaled; offsets in world axes are also rotated.
HSplineSurface Transformed(const HSplineSurface& surface, const Similarity& to_from);

}  // namespace semblance::fitting
