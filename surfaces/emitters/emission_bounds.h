// SPDX-License-Identifier: GPL-3.0-or-later
// Bounds on what emitters give anywhere in a box: least and most of one (thesis 3.2.3, re-derived:
// its maximum at the closest point fails behind a tilted plane, its minimum over the corners fails
// beside a prism), and a quick upper bound of eight at once, for leaving out those too far away.
#pragma once

#include <array>

#include "surfaces/emitters/distance_kernel.h"
#include "surfaces/emitters/emitter.h"
#include "surfaces/emitters/emitter_triangle.h"
#include "surfaces/emitters/flat_kernel.h"

namespace semblance {

// A box, and a ball around it.
struct BoxView {
  Box3 box;
  Vec3 center, half;
  double radius_mm;

  explicit BoxView(const Box3& b)
      : box(b), center(b.center()), half(0.5 * b.sizes()), radius_mm(half.norm()) {}
};

EmissionBounds BoundsOn(const DistanceKernel& kernel, const EmitterTriangle& t, const BoxView& box);
EmissionBounds BoundsOn(const FlatKernel& kernel, const EmitterTriangle& t, const BoxView& box);

// Triangles side by side, one per lane, by what bounds their emission.
struct alignas(64) EmissionUpperBound {
  static constexpr int kLanes = 8;
  using Lanes = std::array<double, kLanes>;

  void Set(int lane, const EmitterTriangle& t);

  std::array<Lanes, 3> low{}, high{};  // a box of where it emits from
  std::array<Lanes, 3> moved{};        // to there
  std::array<Lanes, 3> normal{};
  Lanes offset_mm{};  // of the plane along the normal
  Lanes gain{};
};

// Not less than what each lane emits anywhere within `half`, each way, of the center; infinity
// where the triangle, or the way along which it was moved, may meet that box. Of no use for lanes
// that were not set.
void UpperBoundInBox(const EmissionUpperBound& lanes, const Vec3& center, const Vec3& half,
                     const Falloff& falloff, EmissionUpperBound::Lanes& most);

}  // namespace semblance
