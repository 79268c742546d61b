// SPDX-License-Identifier: GPL-3.0-or-later
// The template is laid over the subject before the fit.
#pragma once

#include <span>

#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// The thesis (4.2) translates and scales the template by hand. Rotation is ours: skulls come in
// whatever pose they were scanned.
struct PlacementOptions {
  bool rotate = true;  // false: shifts and scales only, as in the thesis
  bool scale = true;   // the same along all axes
};
template <class Visitor>
void Fields(Visitor& visit, PlacementOptions& o) {
  visit(
      FieldInfo{.name = "rotate",
                .doc = "turn the template onto the subject; false only shifts (and scales) it, as "
                       "in the thesis"},
      o.rotate);
  visit(FieldInfo{.name = "scale", .doc = "scale the template evenly to the subject's size"},
        o.scale);
}

// The similarity T = subject_from_template that minimises
// sum_i weights_i |on_subject_i - T * on_template_i|^2 (Umeyama 1991, with weights); its rotation
// is proper, never a reflection. on_template and on_subject: n points each, mm; weights: n values >
// 0, or none for equal ones. Throws InputError if the sizes disagree, if a value is not finite or a
// weight not positive, or if the points are too few or too alike: 1 to shift, 2 that differ to
// scale, 3 that are not on a line to rotate.
Similarity PlaceTemplate(std::span<const Vec3> on_template, std::span<const Vec3> on_subject,
                         std::span<const double> weights = {},
                         const PlacementOptions& options = {});

// The whole surface under a similarity: level 0's vertices are mapped, offsets are scaled, and
// turned where they are kept in world axes. Point(uv) of the result is to_from * Point(uv).
HSplineSurface Transformed(const HSplineSurface& surface, const Similarity& to_from);

}  // namespace semblance
