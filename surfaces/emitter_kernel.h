// SPDX-License-Identifier: GPL-3.0-or-later
// What each emitter of emitter.h gives a point, one overload set a kind. For implicit_surface.cc
// alone.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <variant>

#include "surfaces/emitter.h"
#include "surfaces/flat_batch.h"
#include "surfaces/geometry.h"
#include "surfaces/polygon_integral.h"

namespace semblance {

inline constexpr double kMostEmission = 1e12;  // of one triangle

// r^-n from r^2. Whole n, the usual case, needs no pow.
class InversePower {
 public:
  explicit InversePower(double n) : n_(n), whole_(n == std::floor(n) ? static_cast<int>(n) : -1) {}
  double operator()(double r2) const {
    if (whole_ < 0) {
      return std::pow(r2, -0.5 * n_);
    }
    const double inverse2 = 1 / r2;
    double result = whole_ & 1 ? std::sqrt(inverse2) : 1;
    double power = inverse2;
    for (int rest = whole_ >> 1; rest != 0; rest >>= 1, power *= power) {
      result *= rest & 1 ? power : 1;
    }
    return result;
  }

 private:
  double n_;
  int whole_;
};

// One triangle of the skull as its emission needs it.
struct EmitterTriangle {
  Vec3 a, b, c;
  Vec3 centroid, normal;
  double area_mm2 = kNaN, depth_mm = kNaN;
  double longest2_mm2 = kNaN;  // squared length of the longest edge
  double gain = kNaN;          // the factor of its emission that does not depend on the point
  Vec3 edge_normal_a, edge_normal_b,
      edge_normal_c;  // in the plane, out of the triangle, across ab, bc, ca

  // Distances closer than a share of the depth count as that, so that emission stays finite.
  double Floor2(double depth_share) const {
    constexpr double kClosest = 0.05;
    return std::pow(kClosest * depth_share * depth_mm, 2);
  }
};

// Distance from p to the triangle moved by `shift` along its normal, squared, and the height over
// its plane.
inline double SquaredDistance(const EmitterTriangle& t, const Vec3& p) {
  const Vec3 ap = p - t.a, bp = p - t.b, cp = p - t.c;
  const double out_ab = ap.dot(t.edge_normal_a), out_bc = bp.dot(t.edge_normal_b),
               out_ca = cp.dot(t.edge_normal_c);
  if (out_ab <= 0 && out_bc <= 0 && out_ca <= 0) {
    const double h = ap.dot(t.normal);
    return h * h;
  }
  const auto to_segment = [&p](const Vec3& u, const Vec3& v) {
    const Vec3 uv = v - u;
    const double s = std::clamp((p - u).dot(uv) / uv.squaredNorm(), 0.0, 1.0);
    return (p - u - s * uv).squaredNorm();
  };
  return std::min({to_segment(t.a, t.b), to_segment(t.b, t.c), to_segment(t.c, t.a)});
}

inline bool ProjectsOnto(const EmitterTriangle& t, const Vec3& p) {
  return (p - t.a).dot(t.edge_normal_a) <= 0 && (p - t.b).dot(t.edge_normal_b) <= 0 &&
         (p - t.c).dot(t.edge_normal_c) <= 0;
}

// Each kernel: Gain(t) sets EmitterTriangle::gain; Emission(t, p, height) at a height > 0 is at
// most gain / distance^Falloff(), distances taken to the triangle less Advance(t).
// gain / distance^k of the thesis's emitters; 0 where that is less than the cut.
class DistanceFalloff {
 public:
  DistanceFalloff(double decay, double cut_below) : k_(decay), cut_(cut_below), power_(decay) {}
  double Decay() const { return k_; }
  double At(const EmitterTriangle& t, double squared, double depth_share) const {
    const double emission = t.gain * power_(std::max(squared, t.Floor2(depth_share)));
    return emission < cut_ ? 0 : std::min(emission, kMostEmission);
  }

 private:
  double k_, cut_;
  InversePower power_;
};

class ThesisKernel {
 public:
  explicit ThesisKernel(const ThesisEmitter& o) : falloff_(o.decay, o.cut_below) {}
  double Gain(const EmitterTriangle& t) const { return std::pow(t.depth_mm, falloff_.Decay()); }
  double Emission(const EmitterTriangle& t, const Vec3& p, double) const {
    return falloff_.At(t, SquaredDistance(t, p), 1);
  }
  double AtDistance(const EmitterTriangle& t, double d) const { return falloff_.At(t, d * d, 1); }
  double Falloff() const { return falloff_.Decay(); }
  double Advance(const EmitterTriangle&) const { return 0; }
  double EmittingDepth(const EmitterTriangle& t) const { return t.depth_mm; }

 private:
  DistanceFalloff falloff_;
};

class SplitKernel {
 public:
  explicit SplitKernel(const SplitEmitter& o) : t_(o.split), falloff_(o.decay, o.cut_below) {}
  double Gain(const EmitterTriangle& t) const {
    return std::pow(EmittingDepth(t), falloff_.Decay());
  }
  double Emission(const EmitterTriangle& t, const Vec3& p, double height) const {
    const double shift = Advance(t);
    if (height < shift) {
      return ProjectsOnto(t, p) ? kMostEmission : 0;
    }
    return falloff_.At(t, SquaredDistance(t, p - shift * t.normal), 1 - t_);
  }
  // From the moved triangle.
  double AtDistance(const EmitterTriangle& t, double d) const {
    return falloff_.At(t, d * d, 1 - t_);
  }
  double Falloff() const { return falloff_.Decay(); }
  double Advance(const EmitterTriangle& t) const { return t_ * t.depth_mm; }
  double EmittingDepth(const EmitterTriangle& t) const { return (1 - t_) * t.depth_mm; }

 private:
  double t_;
  DistanceFalloff falloff_;
};

// The integral: by the centroid where the triangle is small against its distance, by the three edge
// midpoints (exact for quadratics) where it is less so. Where it is near, in closed form for a
// whole decay, else by four smaller triangles.
class FlatKernel {
 public:
  explicit FlatKernel(const FlatEmitter& o)
      : k_(o.decay),
        closed_(o.decay == std::floor(o.decay) ? static_cast<int>(o.decay) + 1 : -1),
        flat_share_(closed_ > 0 ? std::pow(kLostDigits, 2.0 / closed_) : 0),
        power_(o.decay + 3) {}
  double Gain(const EmitterTriangle& t) const {
    return (k_ + 1) / (2 * std::numbers::pi) * std::pow(t.depth_mm, k_) * t.area_mm2;
  }
  double Emission(const EmitterTriangle& t, const Vec3& p, double height) const {
    const double r2 = (p - t.centroid).squaredNorm();
    if (t.longest2_mm2 <= kCentroidShare * r2) {
      return t.gain * height * power_(r2);
    }
    const double floor2 = t.Floor2(1);
    if (closed_ < 0 || t.longest2_mm2 <= kMidpointShare * r2) {
      return t.gain * height * Mean(p, t.a, t.b, t.c, t.longest2_mm2, floor2);
    }
    // Lower than that, right on the triangle or flat beside it, the integral is taken as from
    // there.
    const double lowest = std::sqrt(std::max(floor2, flat_share_ * r2));
    return t.gain * height * ClosedForm(t, p, std::max(height, lowest)) / t.area_mm2;
  }
  bool Batches() const { return closed_ > 0; }
  // All emissions of a batch whose first triangle is given.
  double Batch(const FlatBatch& batch, const EmitterTriangle* first, const Vec3& p) const {
    FlatBatch::Lanes emission;
    const unsigned near = EmitFlat(batch, p, closed_ + 2, emission);
    double sum = 0;
    for (int l = 0; l < FlatBatch::kLanes; ++l) {
      sum += (near >> l & 1U) != 0 ? Near(first[l], p) : emission[l];
    }
    return sum;
  }
  double Falloff() const { return k_ + 2; }  // height <= distance
  double Advance(const EmitterTriangle&) const { return 0; }
  double EmittingDepth(const EmitterTriangle& t) const { return t.depth_mm; }
  // What the whole triangle would emit if all of it were this far, at most kMostEmission.
  double Above(const EmitterTriangle& t, double height, double distance) const {
    return std::min(t.gain * height * power_(distance * distance), kMostEmission);
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
    return IntegrateInversePower(edges, height, closed_);
  }

  // Mean of |p - q|^-(k+3) over a triangle.
  double Mean(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c, double longest2,
              double floor2) const {
    const Vec3 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
    const double r2 = std::max((p - (a + b + c) / 3).squaredNorm(), floor2);
    if (longest2 <= kMidpointShare * r2) {
      const auto at = [&](const Vec3& q) {
        return power_(std::max((p - q).squaredNorm(), floor2));
      };
      return (at(ab) + at(bc) + at(ca)) / 3;
    }
    const double quarter = longest2 / 4;
    return (Mean(p, a, ab, ca, quarter, floor2) + Mean(p, ab, b, bc, quarter, floor2) +
            Mean(p, ca, bc, c, quarter, floor2) + Mean(p, ab, bc, ca, quarter, floor2)) /
           4;
  }

  double k_;
  static constexpr double kLostDigits = 1e-13;  // of 1e-16, what cancellation leaves is 0.1 %
  int closed_;         // n of IntegrateInversePower; -1 where there is no closed form
  double flat_share_;  // height^2 over distance^2 that the closed form needs
  InversePower power_;
};

using Kernel = std::variant<FlatKernel, SplitKernel, ThesisKernel>;

inline Kernel MakeKernel(const FlatEmitter& o) { return FlatKernel(o); }
inline Kernel MakeKernel(const SplitEmitter& o) { return SplitKernel(o); }
inline Kernel MakeKernel(const ThesisEmitter& o) { return ThesisKernel(o); }

}  // namespace semblance
