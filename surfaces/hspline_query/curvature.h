// SPDX-License-Identifier: GPL-3.0-or-later
// How an H-spline surface bends.
#pragma once

#include <optional>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// Positive where the surface bends towards its normal (of du x dv): a ball seen from outside has
// principal curvatures -1 / radius.
struct SurfaceCurvature {
  double largest_per_mm = kNaN;  // principal curvatures
  double smallest_per_mm = kNaN;
  Vec3 largest_direction = Vec3::Constant(kNaN);   // unit, tangent, at right angles to each other;
  Vec3 smallest_direction = Vec3::Constant(kNaN);  // with the normal right-handed

  double MeanPerMm() const { return (largest_per_mm + smallest_per_mm) / 2; }
  double GaussianPerMm2() const { return largest_per_mm * smallest_per_mm; }
};

// At uv, as StencilAt takes it; empty where the frame is not regular. Throws InputError for a (u,v)
// that is not finite.
std::optional<SurfaceCurvature> CurvatureAt(const HSplineSurface& surface, const Vec2& uv);

}  // namespace semblance
