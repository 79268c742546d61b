// SPDX-License-Identifier: GPL-3.0-or-later
// Bounds of emissions in a box: lower and upper bounds of one emitter (thesis 3.2.3), and a quick
// upper bound of eight emitters at once, used to leave out distant ones. The bounds differ from the
// thesis's: its maximum at the closest point is wrong behind a tilted plane, and its minimum over
// the corners is wrong beside a prism.
#pragma once

#include <array>

#include "surfaces/emitters/distance_kernel.h"
#include "surfaces/emitters/emitter.h"
#include "surfaces/emitters/emitter_triangle.h"
#include "surfaces/emitters/flat_kernel.h"

namespace semblance::surfaces {

// A box and the ball around it.
struct BoxView {
  Box3 box;
  Vec3 center, half;
  double radius_mm;

  explicit BoxView(const Box3& b)
      : box(b), center(b.center()), half(0.5 * b.sizes()), radius_mm(half.norm()) {}
};

EmissionBounds BoundsOn(const DistanceKernel& kernel, const EmitterTriangle& t, const BoxView& box);
EmissionBounds BoundsOn(const FlatKernel& kernel, const EmitterTriangle& t, const BoxView& box);

// The data that bound the emissions of eight triangles, one per lane.
struct alignas(64) EmissionUpperBound {
  static constexpr int kLanes = 8;
  using Lanes = std::array<double, kLanes>;

  void Set(int lane, const EmitterTriangle& t);

  std::array<Lanes, 3> low{}, high{};  // box around the place of emission
  std::array<Lanes, 3> moved{};        // from the triangle to that place
  std::array<Lanes, 3> normal{};
  Lanes offset_mm{};  // plane: n.x = offset
  Lanes gain{};
};

// Writes, per lane, an upper bound of the emission in the box center +- half. It is infinite if the
// triangle, or its path to the place of emission, may meet the box. Lanes that were not set have no
// meaning.
void UpperBoundInBox(const EmissionUpperBound& lanes, const Vec3& center, const Vec3& half,
                     const Falloff& falloff, EmissionUpperBound::Lanes& most);

}  // namespace semblance::surfaces
