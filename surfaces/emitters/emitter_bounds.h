// SPDX-License-Identifier: GPL-3.0-or-later
// The least and the most that an emitter gives anywhere in a box (thesis 3.2.3, re-derived: its
// maximum at the closest point fails behind a tilted plane, its minimum over the corners fails
// beside a prism). For implicit_surface.cc alone.
#pragma once

#include <algorithm>
#include <cmath>

#include "surfaces/emitters/emitter_kernel.h"
#include "surfaces/emitters/implicit_surface.h"

namespace semblance {

// A box, and a ball around it.
struct BoxView {
  Box3 box;
  Vec3 center, half;
  double radius_mm;

  explicit BoxView(const Box3& b)
      : box(b), center(b.center()), half(0.5 * b.sizes()), radius_mm(half.norm()) {}
};

// Not more than the distance of any point of the box from the triangle moved by `shift` along its
// normal; center_mm: that of the box's center.
inline double LeastDistance(const EmitterTriangle& t, double shift, const BoxView& box,
                            double center_mm) {
  const Vec3 low = t.a.cwiseMin(t.b).cwiseMin(t.c) + shift * t.normal,
             high = t.a.cwiseMax(t.b).cwiseMax(t.c) + shift * t.normal;
  return std::max(center_mm - box.radius_mm, box.box.exteriorDistance(Box3(low, high)));
}

struct HeightRange {
  double center, least, most;  // over a triangle's plane; exact
};

inline HeightRange HeightsOver(const EmitterTriangle& t, const BoxView& box) {
  const double center = (box.center - t.a).dot(t.normal), reach = t.normal.cwiseAbs().dot(box.half);
  return {center, center - reach, center + reach};
}

// Emission falls with the distance alone where it is not 0: behind the plane it is.
inline EmissionBounds BoundsOn(const ThesisKernel& kernel, const EmitterTriangle& t,
                               const BoxView& box) {
  const HeightRange height = HeightsOver(t, box);
  if (height.most <= 0) {
    return {};
  }
  const double d = std::sqrt(SquaredDistance(t, box.center));
  return {height.least > 0 ? kernel.AtDistance(t, d + box.radius_mm) : 0,
          kernel.AtDistance(t, LeastDistance(t, 0, box, d))};
}

// Below the moved triangle only its prism emits; the least is taken as 0 unless the whole box lies
// beyond it.
inline EmissionBounds BoundsOn(const SplitKernel& kernel, const EmitterTriangle& t,
                               const BoxView& box) {
  const HeightRange height = HeightsOver(t, box);
  if (height.most <= 0) {
    return {};
  }
  const double shift = kernel.Advance(t);
  EmissionBounds bounds;
  if (height.most >= shift) {
    const double d = std::sqrt(SquaredDistance(t, box.center - shift * t.normal));
    bounds.most = kernel.AtDistance(t, LeastDistance(t, shift, box, d));
    const bool beyond = height.least >= shift && height.least > 0;
    bounds.least = beyond ? kernel.AtDistance(t, d + box.radius_mm) : 0;
  }
  if (height.least < shift) {
    const double beside2 = SquaredDistance(t, box.center - height.center * t.normal);
    const bool over = ProjectsOnto(t, box.center);
    bounds.most = over || beside2 <= box.radius_mm * box.radius_mm ? kMostEmission : bounds.most;
  }
  return bounds;
}

// At height h and distance R >= max(h, nearest) the integrand is at most h / max(h, nearest)^(k+3),
// which grows up to h = nearest and falls from there.
inline EmissionBounds BoundsOn(const FlatKernel& kernel, const EmitterTriangle& t,
                               const BoxView& box) {
  const HeightRange height = HeightsOver(t, box);
  if (height.most <= 0) {
    return {};
  }
  const double above = std::max(0.0, height.least);
  const double nearest =
      std::max(above, LeastDistance(t, 0, box, std::sqrt(SquaredDistance(t, box.center))));
  EmissionBounds bounds;
  bounds.most =
      nearest > 0 ? kernel.Above(t, t.most_share, std::clamp(nearest, above, height.most), nearest)
                  : kMostEmission;
  if (above > 0) {
    const double furthest =
        (box.center - t.centroid).norm() + box.radius_mm + std::sqrt(t.longest2_mm2);
    bounds.least = kernel.Above(t, t.least_share, above, kernel.Lowered(t, furthest));
  }
  return bounds;
}

}  // namespace semblance
