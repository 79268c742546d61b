// SPDX-License-Identifier: GPL-3.0-or-later
// Evaluates the flat emitter (emitter.h): by quadrature for eight triangles at once, and in closed
// form for single triangles that are near the point.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/emitters/emitter.h"
#include "surfaces/emitters/emitter_triangle.h"

namespace semblance::surfaces {

// Eight triangles, one per lane, so that one instruction processes several. A lane that was not set
// emits nothing.
struct alignas(64) FlatEmitterLanes {
  static constexpr int kLanes = 8;
  using Lanes = std::array<double, kLanes>;

  Lanes gain{};               // (k+1) / (2 pi) depth^k area
  std::array<Lanes, 3> at{};  // centroid, mm
  std::array<Lanes, 3> normal{};
  std::array<Lanes, 3> ab{}, ac{};  // edges, mm
  Lanes spread_mm2{};               // trace of the covariance of a triangle's points
  Lanes longest_mm2{};              // squared longest edge

  // Set if the depth is linear over a triangle of the batch. Relative to the mean depth: the rise
  // along ab and ac, the gradient times the covariance of the triangle's points, and this times the
  // gradient.
  bool sloped = false;
  Lanes rise_ab{}, rise_ac{};
  std::array<Lanes, 3> tilt_mm{};
  Lanes bow{};

  // Stores a triangle.
  void Set(int lane, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& unit_normal,
           double lane_gain);
  // Stores the depth's gradient in the plane, divided by the mean depth, in 1/mm. Call it after
  // Set.
  void SetSlope(int lane, const Vec3& slope);
};

// Chooses the quadrature for the mean over a triangle of |p - q|^-power, by the triangle's
// distance.
struct FlatQuadrature {
  explicit FlatQuadrature(int of_power);  // >= 1

  int power;
  // The largest (longest edge / distance)^2 for the centroid with the second derivative, for six
  // points, and for twelve points.
  std::array<double, 3> most_share{};
};

// The state of a sum along runs of four lanes.
struct FlatWalk {
  std::size_t next = 0;  // index of the next run
  std::array<double, 4> sum{};
  unsigned near = 0;  // bits: lanes of the last run that are too near
};

// Adds gain * height * mean of |p - q|^-power for the triangles of runs of four lanes, and nothing
// at heights <= 0. Linear depths weight the mean by (relative depth)^(power - 3). Run r is half r %
// 2 of batch r / 2. The quadrature depends on the distance (FlatQuadrature) and errs by less than 1
// %, and usually by far less. The walk stops after a run with triangles that are too near; these
// are not added. Gives the same bits on every processor.
void AddFlat(std::span<const FlatEmitterLanes> batches, std::span<const std::int32_t> runs,
             const Vec3& p, const FlatQuadrature& quadrature, FlatWalk& walk);

// The flat emitter with any decay. For near triangles an integer decay uses the closed form of
// polygon_integral.h, unless the point lies so low beside the triangle that its terms cancel. This
// is the rule for high decays and large triangles: with decay 15 a point lower than 15 % of its
// distance from the centroid, with decay 6 one lower than 1.4 %. There, and for other decays, the
// mean is by quadrature over parts of the triangle, as small as their distance requires.
class FlatKernel {
 public:
  // Number of emitters that are summed or left out together.
  static constexpr int kRun = FlatEmitterLanes::kLanes / 2;

  explicit FlatKernel(const FlatEmitter& o);

  const Falloff& Fall() const { return falloff_; }
  double Decay() const { return decay_; }
  double Advance(const EmitterTriangle&) const { return 0; }
  double EmittingDepth(const EmitterTriangle& t) const { return t.depth_mm; }
  double Gain(const EmitterTriangle& t) const;
  // The emission at p, at a height > 0 over the triangle's plane; at most kMaxEmission.
  double Emission(const EmitterTriangle& t, const Vec3& p, double height) const;

  // Returns true if lanes and multipoles can be summed, which needs an integer decay.
  bool HasLanes() const { return closed_ > 0; }
  // Groups the emitters by eight, in their order.
  std::vector<FlatEmitterLanes> MakeLanes(std::span<const EmitterTriangle> emitters) const;
  // The sum of emissions over runs of four emitters, of which `lanes` are the groups of eight.
  double Sum(std::span<const FlatEmitterLanes> lanes, std::span<const std::int32_t> runs,
             std::span<const EmitterTriangle> emitters, const Vec3& p) const;

  // The emission if all points of the triangle were at this distance and had this relative depth;
  // at most kMaxEmission.
  double Above(const EmitterTriangle& t, double depth_share, double height, double distance) const;
  // The smallest height that counts; smaller heights count as this one, so that the emission stays
  // finite on the triangle.
  double Lowest(const EmitterTriangle& t) const;
  // An upper bound of the distance that counts for a point at `distance`, however low it is.
  double Lowered(const EmitterTriangle& t, double distance) const;

 private:
  double ClosedForm(const EmitterTriangle& t, const Vec3& p, double height) const;
  double Weight(const EmitterTriangle& t, double rise) const;
  double FarShare(const EmitterTriangle& t, const Vec3& from, double r2) const;
  double Mean(const EmitterTriangle& t, const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c,
              double longest2) const;

  double decay_;
  int closed_;             // n of IntegrateInversePower; -1 without a closed form
  double flat_share_;      // smallest height^2 / distance^2 for the closed form
  double centroid_share_;  // largest (longest edge / distance)^2 for FarShare
  double part_share_;      // the same for a part of the triangle in Mean
  Falloff falloff_;
  FlatQuadrature quadrature_;  // used if there is a closed form
};

}  // namespace semblance::surfaces
