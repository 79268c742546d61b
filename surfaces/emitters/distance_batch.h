// SPDX-License-Identifier: GPL-3.0-or-later
// The thesis's emitters (emitter.h) of eight triangles at once. A lane alone gives the same bits as
// all of them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

// How emission falls: gain / distance^decay, 0 where that is less than the cut, `most` at most.
struct DistanceFall {
  double decay = kNaN;  // > 0
  int whole = -1;       // the decay if it is whole; -1: powers are taken one by one
  double cut = 0;
  double most = kNaN;
};

// Triangles side by side, one a lane, each in the plane of where it emits from: first corner at the
// origin, second on the x axis, third above it. A lane that was not set emits nothing.
struct alignas(64) DistanceBatch {
  static constexpr int kLanes = 8;
  using Lanes = std::array<double, kLanes>;
  struct Edge {
    Lanes x{}, y{}, length{};  // unit direction, mm
  };

  DistanceBatch() { floor_mm2.fill(1); }

  // normal: unit. The triangle emits from where it is moved by advance_mm along its normal, and is
  // solid on the way there; distances below floor_mm count as that.
  void Set(int lane, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& unit_normal,
           double advance, double floor, double lane_gain);

  std::array<Lanes, 3> corner{}, along{}, across{}, normal{};
  Edge ab, ac, bc;  // ab runs along x
  Lanes advance_mm{}, floor_mm2{}, gain{};
};

// A ball around a batch beyond which the cut leaves nothing of what it emits.
struct BatchReach {
  Vec3 center = Vec3::Zero();
  double squared_mm2 = -1;  // of its radius; infinite without a cut
};
std::vector<BatchReach> ReachesOf(std::span<const DistanceBatch> batches, const DistanceFall& fall);

// Those of eight batches side by side.
struct alignas(64) EightReaches {
  std::array<DistanceBatch::Lanes, 3> center{};
  DistanceBatch::Lanes squared_mm2{};
};
// Of some batches, by their numbers.
std::vector<EightReaches> SideBySide(std::span<const BatchReach> reaches,
                                     std::span<const std::int32_t> which);

// What each lane emits at p: 0 at heights <= 0 over its triangle's plane.
void EmitByDistance(const DistanceBatch& batch, const Vec3& p, const DistanceFall& fall,
                    DistanceBatch::Lanes& emission);
// The sum of that over some batches, by their numbers; reaches: theirs, SideBySide. Adds to
// `reaching` how many of them reach p.
double SumByDistance(std::span<const DistanceBatch> batches, std::span<const std::int32_t> which,
                     std::span<const EightReaches> reaches, const Vec3& p, const DistanceFall& fall,
                     std::int64_t& reaching);
double EmitByDistance(const DistanceBatch& batch, int lane, const Vec3& p,
                      const DistanceFall& fall);

}  // namespace semblance
