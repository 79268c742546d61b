// SPDX-License-Identifier: GPL-3.0-or-later
// The second-order multipole expansion of what several flat emitters give together from afar, with
// a bound on its error.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "surfaces/emitters/emitter_triangle.h"

namespace semblance {

// The emitters' sum at p is
//   K = sum of gain * integral of max(n.(p - x), 0) / |p - x|^power dm(x),
// m the share of the triangle's depth^decay. In front of all planes its Taylor series about x =
// center is kept to the second order as far as
//   (N.u) |u|^-power (1 + power / 2 |u|^-2 ((power + 2) u'Cu |u|^-2 - tr C))
// gives it, u = p - center, N = sum of gain n, C the spread; 0 where N.u <= 0.
struct EmitterMultipole {
  Vec3 gain_normal = Vec3::Zero();
  Vec3 center = Vec3::Constant(kNaN);  // where the first order's trace is 0
  Mat3 spread_mm2 = Mat3::Zero();      // second moment about the center, weighted by gain n.N

  // What bounds the error: how far the emitters and their planes are from the center, their normals
  // from N's, and what the form above lacks of the first and the second order.
  double radius_mm = std::numeric_limits<double>::infinity(), plane_mm = 0, tilt = 0;
  double gain = 0, first = 0, second = 0;
  double third = 0, third_by_plane = 0;  // moments |x - center|^3, |n.(x - center)| |x - center|^2
};

// decay: of the flat emitter; power = decay + 3, whole. Where depths are linear, moments are taken
// by quadrature.
EmitterMultipole MultipoleOf(std::span<const EmitterTriangle> emitters, int decay);

// Four multipoles side by side, one per lane. A lane that was not set emits nothing.
struct alignas(64) MultipoleLanes {
  static constexpr int kLanes = 4;
  using Lanes = std::array<double, kLanes>;

  MultipoleLanes();
  void Set(int lane, const EmitterMultipole& multipole, int power);

  // Not less than how much all four together err anywhere within `half`, each way, of the center;
  // infinity where a series is of no use.
  double ErrorInBox(const Vec3& box_center, const Vec3& half, int power) const;

  std::array<Lanes, 3> at, gain_normal{};
  std::array<Lanes, 6> bend{};  // power (power + 2) / 2 times xx, yy, zz, 2 xy, 2 xz, 2 yz
  Lanes fade{};                 // power / 2 times the trace
  // What bounds the error, as in EmitterMultipole.
  std::array<Lanes, 3> normal{};
  Lanes radius_mm{}, plane_mm{}, tilt{}, gain{}, first{}, second{}, third{}, third_by_plane{};
};

// The sum at p of some of the lanes, by their numbers. The same bits whatever the processor.
double SumMultipoles(std::span<const MultipoleLanes> lanes, std::span<const std::int32_t> which,
                     const Vec3& p, int power);

}  // namespace semblance
