// SPDX-License-Identifier: GPL-3.0-or-later
// What the flat emitter gives a point. For implicit_surface.cc alone.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <span>

#include "surfaces/emitters/emitter.h"
#include "surfaces/emitters/emitter_reach.h"
#include "surfaces/emitters/emitter_triangle.h"
#include "surfaces/emitters/flat_batch.h"
#include "surfaces/emitters/polygon_integral.h"

namespace semblance {

// The integral: by the centroid and the second derivative there where the triangle is small against
// its distance. Where it is near, in closed form for a whole decay, else by the three edge
// midpoints (exact for quadratics) of ever smaller triangles.
class FlatKernel {
 public:
  static constexpr int kRun = FlatBatch::kLanes / 2;
  explicit FlatKernel(const FlatEmitter& o)
      : k_(o.decay),
        closed_(o.decay == std::floor(o.decay) ? static_cast<int>(o.decay) + 1 : -1),
        flat_share_(closed_ > 0 ? std::pow(kLostDigits, 2.0 / closed_) : 0),
        power_(o.decay + 3),
        fall_(std::max(closed_, 1) + 2) {}
  double Gain(const EmitterTriangle& t) const {
    return (k_ + 1) / (2 * std::numbers::pi) * std::pow(t.depth_mm, k_) * t.area_mm2;
  }
  double Emission(const EmitterTriangle& t, const Vec3& p, double height) const {
    const double r2 = (p - t.centroid).squaredNorm();
    if (t.longest2_mm2 <= kCentroidShare * r2) {
      return t.gain * height * power_(r2) * FarShare(t, p - t.centroid, r2);
    }
    const double floor2 = t.Floor2(1);
    if (closed_ < 0) {
      return t.gain * height * Mean(t, p, t.a, t.b, t.c, t.longest2_mm2);
    }
    // Lower than that, right on the triangle or flat beside it, the integral is taken as from
    // there.
    const double lowest = std::sqrt(std::max(floor2, flat_share_ * r2));
    return t.gain * height * ClosedForm(t, p, std::max(height, lowest)) / t.area_mm2;
  }
  bool Batches() const { return closed_ > 0; }
  // All emissions of runs of four of the emitters, of which the batches are.
  double Sum(std::span<const FlatBatch> batches, std::span<const std::int32_t> runs,
             std::span<const EmitterTriangle> emitters, const Vec3& p) const {
    FlatWalk walk;
    while (walk.next < runs.size()) {
      AddFlat(batches, runs, p, fall_, walk);
      for (unsigned near = walk.near; near != 0; near &= near - 1) {
        const int lane = std::countr_zero(near);
        walk.sum[lane] += Near(emitters[kRun * runs[walk.next - 1] + lane], p);
      }
    }
    return (walk.sum[0] + walk.sum[1]) + (walk.sum[2] + walk.sum[3]);
  }
  int Power() const { return fall_.power; }  // of the batches and clusters
  double Decay() const { return k_; }
  double Most(double squared, double height) const {
    return std::min(height, std::sqrt(squared)) * power_(squared);
  }
  double Cut() const { return 0; }
  ReachFall Reach() const { return {k_ + 3, closed_ > 0 ? closed_ + 2 : -1, true, 0}; }
  double Advance(const EmitterTriangle&) const { return 0; }
  double EmittingDepth(const EmitterTriangle& t) const { return t.depth_mm; }
  // What the triangle would emit if all of it were this far and had this share of its depth, at
  // most kMostEmission.
  double Above(const EmitterTriangle& t, double depth_share, double height, double distance) const {
    const double gain = depth_share == 1 ? t.gain : t.gain * std::pow(depth_share, k_);
    return std::min(gain * height * power_(distance * distance), kMostEmission);
  }
  // A distance that is not less than what `distance` counts as low over the triangle.
  double Lowered(const EmitterTriangle& t, double distance) const {
    return std::sqrt((1 + flat_share_) * distance * distance + t.Floor2(1));
  }

 private:
  // of the squared distance
  static constexpr double kCentroidShare = 0.02, kMidpointShare = 0.06;

  double Near(const EmitterTriangle& t, const Vec3& p) const {
    return std::min(Emission(t, p, (p - t.a).dot(t.normal)), kMostEmission);
  }

  double ClosedForm(const EmitterTriangle& t, const Vec3& p, double height) const {
    const auto edge = [&p](const Vec3& u, const Vec3& v, const Vec3& out) {
      const Vec3 from = u - p, along = v - u;
      const double inverse = 1 / along.norm(), begin = from.dot(along) * inverse;
      return EdgeFromFoot{from.dot(out) * inverse, begin, begin + 1 / inverse};
    };
    const std::array<EdgeFromFoot, 3> edges = {edge(t.a, t.b, t.edge_normal_a),
                                               edge(t.b, t.c, t.edge_normal_b),
                                               edge(t.c, t.a, t.edge_normal_c)};
    const double integral = IntegrateInversePower(edges, height, closed_);
    if (!t.IsSloped()) {
      return integral;
    }
    // R^-(n+2) (q - foot) is the gradient of -R^-n / n: the first moment is an integral over edges.
    const std::array<const Vec3*, 3> outward = {&t.edge_normal_a, &t.edge_normal_b,
                                                &t.edge_normal_c};
    double moment = 0;  // along the slope
    for (int e = 0; e < 3; ++e) {
      moment -= outward[e]->dot(t.slope) / (edges[e].end - edges[e].begin) *
                IntegrateAlong(edges[e], height, closed_) / closed_;
    }
    return integral * Weight(t, (p - t.centroid).dot(t.slope) + moment / integral);
  }

  // Depth^k where it is 1 + rise times the mean, over that of the mean. Taken where the integrand
  // has its centroid it is right for a linear depth to second order.
  double Weight(const EmitterTriangle& t, double rise) const {
    return std::pow(std::clamp(1 + rise, t.least_share, t.most_share), k_);
  }

  // The mean over a triangle seen from afar, by `from`, over the value at its centroid: by the
  // integrand's second derivative, and with the depth's weight.
  double FarShare(const EmitterTriangle& t, const Vec3& from, double r2) const {
    const double power = k_ + 3;
    double along2 = 0, spread = 0, nearer = 0, rise2 = 0;
    for (const Vec3& edge : {Vec3(t.b - t.a), Vec3(t.c - t.b), Vec3(t.a - t.c)}) {
      const double along = from.dot(edge), rise = edge.dot(t.slope);
      along2 += along * along / 36;
      spread += edge.squaredNorm() / 36;
      nearer += along * rise / 36;
      rise2 += rise * rise / 36;
    }
    const double bend = 0.5 * power / r2 * ((power + 2) * along2 / r2 - spread);
    return 1 + bend + k_ * (power * nearer / r2 + 0.5 * (k_ - 1) * rise2);
  }

  // Mean of |p - q|^-(k+3), weighted by the depth, over part a, b, c of a triangle.
  double Mean(const EmitterTriangle& t, const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c,
              double longest2) const {
    const double floor2 = t.Floor2(1);
    const Vec3 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
    const double r2 = std::max((p - (a + b + c) / 3).squaredNorm(), floor2);
    if (longest2 <= kMidpointShare * r2) {
      const auto at = [&](const Vec3& q) {
        const double value = power_(std::max((p - q).squaredNorm(), floor2));
        return t.IsSloped() ? value * Weight(t, (q - t.centroid).dot(t.slope)) : value;
      };
      return (at(ab) + at(bc) + at(ca)) / 3;
    }
    const double quarter = longest2 / 4;
    return (Mean(t, p, a, ab, ca, quarter) + Mean(t, p, ab, b, bc, quarter) +
            Mean(t, p, ca, bc, c, quarter) + Mean(t, p, ab, bc, ca, quarter)) /
           4;
  }

  double k_;
  static constexpr double kLostDigits = 1e-13;  // of 1e-16, what cancellation leaves is 0.1 %
  int closed_;         // n of IntegrateInversePower; -1 where there is no closed form
  double flat_share_;  // height^2 over distance^2 that the closed form needs
  InversePower power_;
  FlatFall fall_;  // where there is a closed form
};

}  // namespace semblance
