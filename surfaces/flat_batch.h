// SPDX-License-Identifier: GPL-3.0-or-later
// The flat emitter (emitter.h) of eight triangles at once, for all points that are not right at
// them.
#pragma once

#include <array>

#include "surfaces/geometry.h"

namespace semblance {

// Triangles side by side, one a lane, so that the compiler can take several in one instruction. A
// lane that was not set emits nothing.
struct FlatBatch {
  static constexpr int kLanes = 8;
  using Lanes = std::array<double, kLanes>;

  Lanes gain{};               // (k+1) / (2 pi) depth^k area
  std::array<Lanes, 3> at{};  // centroid, mm
  std::array<Lanes, 3> normal{};
  std::array<Lanes, 3> ab{}, ac{};  // edges, mm
  Lanes spread_mm2{};               // trace of the covariance of the triangle's area
  Lanes longest_mm2{};              // squared length of the longest edge

  // Where the depth is linear over some triangle of the batch. Relative to its mean: its rise along
  // ab and ac, the gradient times the area's covariance, and that times the gradient.
  bool sloped = false;
  Lanes rise_ab{}, rise_ac{};
  std::array<Lanes, 3> tilt_mm{};
  Lanes bow{};

  // normal: unit.
  void Set(int lane, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& unit_normal,
           double lane_gain);
  // The gradient of a lane's depth over its mean, in its plane, 1 / mm. After Set.
  void SetSlope(int lane, const Vec3& slope);
};

// gain * height * the mean of |p - q|^-power, where sloped weighted by (depth over its mean)^(power
// - 3), over each triangle, 0 at height <= 0; power >= 1. The
// mean is that of 1, 4 or 16 equal parts, as p is near, each taken at its centroid with the
// integrand's second derivative: within 1 %, and far nearer than that as a rule. Returns the lanes
// that are too near for 16, as bits; their emission is 0. The same bits whatever the processor.
unsigned EmitFlat(const FlatBatch& batch, const Vec3& p, int power, FlatBatch::Lanes& emission);

}  // namespace semblance
