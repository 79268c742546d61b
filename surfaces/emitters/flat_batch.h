// SPDX-License-Identifier: GPL-3.0-or-later
// The flat emitter (emitter.h) of eight triangles at once, for all points that are not right at
// them.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "surfaces/base/geometry.h"

namespace semblance {

// Triangles side by side, one a lane, so that the compiler can take several in one instruction. A
// lane that was not set emits nothing.
struct alignas(64) FlatBatch {
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

// How the integrand falls: 1 / distance^power.
struct FlatFall {
  explicit FlatFall(int of_power);  // >= 1

  int power;
  // Squared longest edge over squared distance up to which each way of taking the mean does.
  std::array<double, 3> most_share{};
};

// Where a walk along runs of four lanes has come to.
struct FlatWalk {
  std::size_t next = 0;  // of the runs
  std::array<double, 4> sum{};
  unsigned near = 0;  // lanes of the last run that are to be added otherwise, as bits
};

// Adds, lane by lane, gain * height * the mean of |p - q|^-power, where sloped weighted by (depth
// over its mean)^(power - 3), over the triangles of runs of four lanes; nothing at height <= 0. Run
// r is half r % 2 of batch r / 2. The mean is taken at the centroid with the integrand's second
// derivative, or at 6 or 12 points, as p is near: within 1 %, and far nearer than that as a rule.
// Stops after a run with lanes that are too near for that; nothing is added for them. The same bits
// whatever the processor.
void AddFlat(std::span<const FlatBatch> batches, std::span<const std::int32_t> runs, const Vec3& p,
             const FlatFall& fall, FlatWalk& walk);

}  // namespace semblance
