// SPDX-License-Identifier: GPL-3.0-or-later
// Evaluates the thesis's emitters (eq. 3.1 and 3.2, emitter.h) for eight triangles at once.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/emitters/emitter.h"
#include "surfaces/emitters/emitter_triangle.h"

namespace semblance::surfaces {

// Eight triangles, one per lane, each in the plane from which it emits: the first corner at the
// origin, the second on the x axis, the third at y > 0. A lane that was not set emits nothing. One
// lane alone gives the same bits as all lanes together.
struct alignas(64) DistanceEmitterLanes {
  static constexpr int kLanes = 8;
  using Lanes = std::array<double, kLanes>;
  struct Edge {
    Lanes x{}, y{}, length{};  // unit direction; length in mm
  };

  DistanceEmitterLanes() { floor_mm2.fill(1); }

  // Stores a triangle that emits from its position moved by `advance` (mm) along its normal and is
  // solid on the way. Distances below `floor` (mm) count as `floor`.
  void Set(int lane, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& unit_normal,
           double advance, double floor, double lane_gain);

  std::array<Lanes, 3> corner{}, along{}, across{}, normal{};
  Edge ab, ac, bc;  // ab runs along x
  Lanes advance_mm{}, floor_mm2{}, gain{};
};

// The emitter of eq. 3.2. A split of 0 gives the emitter of eq. 3.1.
class DistanceKernel {
 public:
  // Number of emitters that are summed or left out together.
  static constexpr int kRun = DistanceEmitterLanes::kLanes;

  explicit DistanceKernel(const ThesisEmitter& o) : DistanceKernel(o.decay, 0, o.cut_below) {}
  explicit DistanceKernel(const SplitEmitter& o) : DistanceKernel(o.decay, o.split, o.cut_below) {}

  const Falloff& Fall() const { return falloff_; }
  double Decay() const { return falloff_.power; }
  double Advance(const EmitterTriangle& t) const { return split_ * t.depth_mm; }
  double EmittingDepth(const EmitterTriangle& t) const { return (1 - split_) * t.depth_mm; }
  double Gain(const EmitterTriangle& t) const { return std::pow(EmittingDepth(t), Decay()); }
  double Floor(const EmitterTriangle& t) const { return std::sqrt(t.Floor2(1 - split_)); }
  // The emission in front of the moved triangle, at a distance from it.
  double AtDistance(const EmitterTriangle& t, double distance) const;

  // Groups the emitters by eight, in their order.
  std::vector<DistanceEmitterLanes> MakeLanes(std::span<const EmitterTriangle> emitters) const;

 private:
  DistanceKernel(double decay, double split, double cut)
      : split_(split), falloff_(MakeFalloff(decay, false, cut)) {}

  double split_;
  Falloff falloff_;
};

// A ball around the four triangles of half the lanes. Beyond the ball their emissions fall below
// the cut.
struct ReachBall {
  Vec3 center = Vec3::Zero();
  double squared_mm2 = -1;  // squared radius; infinite without a cut
};
// Makes two balls per eight lanes.
std::vector<ReachBall> MakeReachBalls(std::span<const DistanceEmitterLanes> lanes,
                                      const Falloff& falloff);

// Eight balls, one per lane.
struct alignas(64) ReachLanes {
  ReachLanes() { squared_mm2.fill(-1); }

  std::array<DistanceEmitterLanes::Lanes, 3> center{};
  DistanceEmitterLanes::Lanes squared_mm2{};
};
// Gathers the balls of some groups of lanes, given by index.
std::vector<ReachLanes> Gather(std::span<const ReachBall> balls,
                               std::span<const std::int32_t> which);

// The emission of one lane at p; 0 at heights <= 0 over its triangle's plane.
double EmitByDistance(const DistanceEmitterLanes& lanes, int lane, const Vec3& p,
                      const Falloff& falloff);
// The sum at p over some groups of lanes, given by index (`which`) and with their balls (`reaches`,
// from Gather). Adds to `reaching` the number of emitters in balls that contain p.
double SumByDistance(std::span<const DistanceEmitterLanes> lanes,
                     std::span<const std::int32_t> which, std::span<const ReachLanes> reaches,
                     const Vec3& p, const Falloff& falloff, std::int64_t& reaching);

}  // namespace semblance::surfaces
