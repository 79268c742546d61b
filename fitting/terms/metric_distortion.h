// SPDX-License-Identifier: GPL-3.0-or-later
// How much a fit has stretched parts of the template: the damage to features (thesis 4.3).
#pragma once

#include <functional>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

struct MetricDistortion {
  double rms_strain = kNaN;  // of Green's strain |E| (strain.h), by the template's area
  double max_strain = kNaN;
  double rms_area = kNaN;  // of dA / dA of the template - 1
  double area_cm2 = 0;     // of the template where it was looked at
};

// Over the places (u,v), 2 x 2 Gauss points per patch of the finest level, whose point of the
// template `rest` is `wanted` and has tangents. surface: of the same shape. NaN if there is no such
// place.
MetricDistortion DistortionWhere(const HSplineSurface& surface, const HSplineSurface& rest,
                                 const std::function<bool(const Vec3&)>& wanted);

}  // namespace semblance
