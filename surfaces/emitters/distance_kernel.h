// SPDX-License-Identifier: GPL-3.0-or-later
// The emitters of the thesis (eq. 3.1 and 3.2, emitter.h), eight triangles at once.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/emitters/emitter.h"
#include "surfaces/emitters/emitter_triangle.h"

namespace semblance {

// Triangles side by side, one per lane, each in the plane of where it emits from: first corner at
// the origin, second on the x axis, third above it. A lane that was not set emits nothing. A lane
// alone gives the same bits as all of them.
struct alignas(64) DistanceEmitterLanes {
  static constexpr int kLanes = 8;
  using Lanes = std::array<double, kLanes>;
  struct Edge {
    Lanes x{}, y{}, length{};  // unit direction, mm
  };

  DistanceEmitterLanes() { floor_mm2.fill(1); }

  // The triangle emits from where it is moved by advance_mm along its normal, and is solid on the
  // way there; distances below floor_mm count as that.
  void Set(int lane, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& unit_normal,
           double advance, double floor, double lane_gain);

  std::array<Lanes, 3> corner{}, along{}, across{}, normal{};
  Edge ab, ac, bc;  // ab runs along x
  Lanes advance_mm{}, floor_mm2{}, gain{};
};

// The emitter of eq. 3.2; that of eq. 3.1 is the same with a split of 0.
class DistanceKernel {
 public:
  // How many emitters are summed or left out together.
  static constexpr int kRun = DistanceEmitterLanes::kLanes;

  explicit DistanceKernel(const ThesisEmitter& o) : DistanceKernel(o.decay, 0, o.cut_below) {}
  explicit DistanceKernel(const SplitEmitter& o) : DistanceKernel(o.decay, o.split, o.cut_below) {}

  const Falloff& Fall() const { return falloff_; }
  double Decay() const { return falloff_.power; }
  double Advance(const EmitterTriangle& t) const { return split_ * t.depth_mm; }
  double EmittingDepth(const EmitterTriangle& t) const { return (1 - split_) * t.depth_mm; }
  double Gain(const EmitterTriangle& t) const { return std::pow(EmittingDepth(t), Decay()); }
  double Floor(const EmitterTriangle& t) const { return std::sqrt(t.Floor2(1 - split_)); }
  // In front of the moved triangle, at a distance from it.
  double AtDistance(const EmitterTriangle& t, double distance) const;

  // Of each eight emitters, in their order.
  std::vector<DistanceEmitterLanes> LanesOf(std::span<const EmitterTriangle> emitters) const;

 private:
  DistanceKernel(double decay, double split, double cut)
      : split_(split), falloff_(MakeFalloff(decay, false, cut)) {}

  double split_;
  Falloff falloff_;
};

// A ball around four triangles, half of the lanes, beyond which the cut leaves nothing of what they
// emit.
struct ReachBall {
  Vec3 center = Vec3::Zero();
  double squared_mm2 = -1;  // of its radius; infinite without a cut
};
// Two for each eight lanes.
std::vector<ReachBall> ReachBallsOf(std::span<const DistanceEmitterLanes> lanes,
                                    const Falloff& falloff);

// Eight balls side by side.
struct alignas(64) ReachLanes {
  ReachLanes() { squared_mm2.fill(-1); }

  std::array<DistanceEmitterLanes::Lanes, 3> center{};
  DistanceEmitterLanes::Lanes squared_mm2{};
};
// Those of some lanes, by their numbers.
std::vector<ReachLanes> Gather(std::span<const ReachBall> balls,
                               std::span<const std::int32_t> which);

// What one lane emits at p: 0 at heights <= 0 over its triangle's plane.
double EmitByDistance(const DistanceEmitterLanes& lanes, int lane, const Vec3& p,
                      const Falloff& falloff);
// The sum at p of all lanes of some, by their numbers; reaches: theirs, by Gather. Adds to
// `reaching` how many emitters were in balls that reach p.
double SumByDistance(std::span<const DistanceEmitterLanes> lanes,
                     std::span<const std::int32_t> which, std::span<const ReachLanes> reaches,
                     const Vec3& p, const Falloff& falloff, std::int64_t& reaching);

}  // namespace semblance
