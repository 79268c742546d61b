// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/emission_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "surfaces/base/simd.h"

namespace semblance::surfaces {
namespace {

// Squared distance along one axis between [low, high] and center +- half.
SEMBLANCE_INLINE Wide SquaredGap(const Wide& low, const Wide& high, double center, double half) {
  const Wide gap = Greater(Greater(low - center, center - high) - half, Wide{});
  return gap * gap;
}

SEMBLANCE_INLINE Wide UpperBounds(const EmissionUpperBound& b, int first, const Vec3& center,
                                  const Vec3& half, const Falloff& falloff) {
  Wide height = -Load<Wide>(b.offset_mm, first), slack = Magnitude(height), from2{}, way2{};
  for (int axis = 0; axis < 3; ++axis) {
    const double at = center[axis], reach = half[axis];
    const Wide normal = Load<Wide>(b.normal[axis], first), low = Load<Wide>(b.low[axis], first),
               high = Load<Wide>(b.high[axis], first), moved = Load<Wide>(b.moved[axis], first);
    height += normal * at + Magnitude(normal) * reach;
    slack += std::abs(at) + reach;
    from2 += SquaredGap(low, high, at, reach);
    way2 += SquaredGap(Smaller(low, low - moved), Greater(high, high - moved), at, reach);
  }
  height += kRounding * slack;
  Wide most =
      Load<Wide>(b.gain, first) * InversePowerFromSquare(from2, falloff.power, falloff.whole);
  if (falloff.by_height) {
    most *= Smaller(height, SquareRoot(from2));
  }
  most = most < All<Wide>((1 - kRounding) * falloff.cut) ? Wide{} : most;
  most = way2 > 0 ? most : All<Wide>(std::numeric_limits<double>::infinity());
  return height > 0 ? most : Wide{};
}

// A lower bound of the distance from the box to the triangle moved by `shift` along its normal.
// center_mm: the distance of the box's center.
double LeastDistance(const EmitterTriangle& t, double shift, const BoxView& box, double center_mm) {
  const Vec3 low = t.a.cwiseMin(t.b).cwiseMin(t.c) + shift * t.normal,
             high = t.a.cwiseMax(t.b).cwiseMax(t.c) + shift * t.normal;
  return std::max(center_mm - box.radius_mm, box.box.exteriorDistance(Box3(low, high)));
}

struct HeightRange {
  double center, least, most;  // heights over a triangle's plane; exact
};

HeightRange HeightsOver(const EmitterTriangle& t, const BoxView& box) {
  const double center = (box.center - t.a).dot(t.normal), reach = t.normal.cwiseAbs().dot(box.half);
  return {center, center - reach, center + reach};
}

}  // namespace

// In front of the moved triangle, emission falls with the distance. The distance is a convex
// function, so that its largest value in a box, and with it the smallest emission, is at a corner.
// Behind the moved triangle only the prism emits; there the lower bound is 0.
EmissionBounds BoundsOn(const DistanceKernel& kernel, const EmitterTriangle& t,
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
    bounds.least_at_corner = beyond;
  }
  if (shift > 0 && height.least < shift) {
    const double beside2 = SquaredDistance(t, box.center - height.center * t.normal);
    const bool over = ProjectsOnto(t, box.center);
    bounds.most = over || beside2 <= box.radius_mm * box.radius_mm ? kMaxEmission : bounds.most;
  }
  return bounds;
}

// In front of the triangle the emission is quasi-concave, so that its smallest value in a box is at
// a corner. A point of the triangle contributes h R^-m with m = k + 3, and (h R^-m)^(-1/(m-1)) is
// convex; integration over the triangle preserves this (Borell 1975, Brascamp & Lieb 1976). The
// upper bound: at height h and distance R >= max(h, nearest) the integrand is at most h / max(h,
// nearest)^(k+3), which grows up to h = nearest and falls beyond.
EmissionBounds BoundsOn(const FlatKernel& kernel, const EmitterTriangle& t, const BoxView& box) {
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
                  : kMaxEmission;
  if (above > 0) {
    const double furthest =
        (box.center - t.centroid).norm() + box.radius_mm + std::sqrt(t.longest2_mm2);
    bounds.least = kernel.Above(t, t.least_share, above, kernel.Lowered(t, furthest));
    bounds.least_at_corner = above >= kernel.Lowest(t);
  }
  return bounds;
}

void EmissionUpperBound::Set(int lane, const EmitterTriangle& t) {
  const Vec3 least = t.a.cwiseMin(t.b).cwiseMin(t.c) + t.moved,
             most = t.a.cwiseMax(t.b).cwiseMax(t.c) + t.moved;
  for (int k = 0; k < 3; ++k) {
    low[k][lane] = least[k];
    high[k][lane] = most[k];
    moved[k][lane] = t.moved[k];
    normal[k][lane] = t.normal[k];
  }
  offset_mm[lane] = t.a.dot(t.normal);
  gain[lane] = (1 + kRounding) * t.most_gain;
}

SEMBLANCE_WIDE void UpperBoundInBox(const EmissionUpperBound& lanes, const Vec3& center,
                                    const Vec3& half, const Falloff& falloff,
                                    EmissionUpperBound::Lanes& most) {
  for (int first = 0; first < EmissionUpperBound::kLanes; first += kLaneCount<Wide>) {
    Store(UpperBounds(lanes, first, center, half, falloff), most, first);
  }
}

}  // namespace semblance::surfaces
