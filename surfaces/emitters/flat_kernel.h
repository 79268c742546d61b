// SPDX-License-Identifier: GPL-3.0-or-later
// The flat emitter (emitter.h): eight triangles at once for all points that are not right at them,
// one by one in closed form right at them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/emitters/emitter.h"
#include "surfaces/emitters/emitter_triangle.h"

namespace semblance {

// Triangles side by side, one per lane, so that the compiler can take several in one instruction. A
// lane that was not set emits nothing.
struct alignas(64) FlatEmitterLanes {
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

// How the mean over a triangle of |p - q|^-power is taken, by how near the triangle is.
struct FlatQuadrature {
  explicit FlatQuadrature(int of_power);  // >= 1

  int power;
  // Squared longest edge over squared distance up to which the centroid with the second derivative,
  // six and twelve points do.
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
void AddFlat(std::span<const FlatEmitterLanes> batches, std::span<const std::int32_t> runs,
             const Vec3& p, const FlatQuadrature& quadrature, FlatWalk& walk);

// Where a triangle is near and the decay is not whole, the integral is taken by the three edge
// midpoints (exact for quadratics) of ever smaller triangles.
class FlatKernel {
 public:
  // How many emitters are summed or left out together.
  static constexpr int kRun = FlatEmitterLanes::kLanes / 2;

  explicit FlatKernel(const FlatEmitter& o);

  const Falloff& Fall() const { return falloff_; }
  double Decay() const { return decay_; }
  double Advance(const EmitterTriangle&) const { return 0; }
  double EmittingDepth(const EmitterTriangle& t) const { return t.depth_mm; }
  double Gain(const EmitterTriangle& t) const;
  // At a height > 0 over the triangle's plane; at most kMostEmission.
  double Emission(const EmitterTriangle& t, const Vec3& p, double height) const;

  // Whether lanes and multipoles can be summed: where the decay is whole.
  bool HasLanes() const { return closed_ > 0; }
  // Of each eight emitters, in their order.
  std::vector<FlatEmitterLanes> LanesOf(std::span<const EmitterTriangle> emitters) const;
  // All emissions of runs of four of the emitters whose lanes are given.
  double Sum(std::span<const FlatEmitterLanes> lanes, std::span<const std::int32_t> runs,
             std::span<const EmitterTriangle> emitters, const Vec3& p) const;

  // What the triangle would emit if all of it were this far and had this share of its depth, at
  // most kMostEmission.
  double Above(const EmitterTriangle& t, double depth_share, double height, double distance) const;
  // Lower than that the emission is taken as from there, right on the triangle or flat beside it;
  // squared: of the distance from its centroid.
  double Lowest(const EmitterTriangle& t, double squared) const;
  // A distance that is not less than what `distance` counts as low over the triangle.
  double Lowered(const EmitterTriangle& t, double distance) const;

 private:
  double ClosedForm(const EmitterTriangle& t, const Vec3& p, double height) const;
  double Weight(const EmitterTriangle& t, double rise) const;
  double FarShare(const EmitterTriangle& t, const Vec3& from, double r2) const;
  double Mean(const EmitterTriangle& t, const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c,
              double longest2) const;

  double decay_;
  int closed_;         // n of IntegrateInversePower; -1 where there is no closed form
  double flat_share_;  // height^2 over distance^2 that the closed form needs
  Falloff falloff_;
  FlatQuadrature quadrature_;  // where there is a closed form
};

}  // namespace semblance
