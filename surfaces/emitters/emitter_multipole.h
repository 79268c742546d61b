// SPDX-License-Identifier: GPL-3.0-or-later
// The second-order multipole expansion of the joint far field of several flat emitters, with a
// bound on its error (docs/explanation/mathematics.md, 2).
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "surfaces/emitters/emitter_triangle.h"

namespace semblance::surfaces {

// The sum of the emitters at p is
//   K = sum of gain * integral of max(n.(p - x), 0) / |p - x|^power dm(x),
// where m weights a triangle's points by depth^decay relative to its mean. In front of all planes
// the Taylor series of K about x = center is kept to the second order in the form
//   (N.u) |u|^-power (1 + power / 2 |u|^-2 ((power + 2) u'Cu |u|^-2 - tr C))
// with u = p - center, N = sum of gain n, and C the spread. It is 0 for N.u <= 0.
struct EmitterMultipole {
  Vec3 gain_normal = Vec3::Zero();
  Vec3 center = Vec3::Constant(kNaN);  // the trace of the first moments is 0 about it
  Mat3 spread_mm2 = Mat3::Zero();      // second moments about the center, weighted by gain n.N

  // Data of the error bound: largest distances of the emitters and of their planes from the center,
  // largest difference of a normal from N / |N|, and the parts of the first and second order that
  // the form above lacks.
  double radius_mm = std::numeric_limits<double>::infinity(), plane_mm = 0, tilt = 0;
  double gain = 0, first = 0, second = 0;
  double third = 0, third_by_plane = 0;  // |x - center|^3; |n.(x - center)| |x - center|^2
};

// Computes the expansion for an integer decay of the flat emitter; power = decay + 3. Moments of
// linear depths are computed by quadrature.
EmitterMultipole MakeMultipole(std::span<const EmitterTriangle> emitters, int decay);

// Four multipoles, one per lane. A lane that was not set emits nothing.
struct alignas(64) MultipoleLanes {
  static constexpr int kLanes = 4;
  using Lanes = std::array<double, kLanes>;

  MultipoleLanes();
  void Set(int lane, const EmitterMultipole& multipole, int power);

  // An upper bound of the joint error of all four in the box center +- half; infinite where a
  // series does not converge.
  double ErrorInBox(const Vec3& box_center, const Vec3& half, int power) const;

  std::array<Lanes, 3> at, gain_normal{};
  std::array<Lanes, 6> bend{};  // power (power + 2) / 2 times xx, yy, zz, 2 xy, 2 xz, 2 yz
  Lanes fade{};                 // power / 2 times the trace of C
  // Data of the error bound, as in EmitterMultipole.
  std::array<Lanes, 3> normal{};
  Lanes radius_mm{}, plane_mm{}, tilt{}, gain{}, first{}, second{}, third{}, third_by_plane{};
};

// The sum at p over some groups of lanes, given by index. Gives the same bits on every processor.
double SumMultipoles(std::span<const MultipoleLanes> lanes, std::span<const std::int32_t> which,
                     const Vec3& p, int power);

}  // namespace semblance::surfaces
