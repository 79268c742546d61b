// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/flat_kernel.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <span>

#include "surfaces/base/simd.h"
#include "surfaces/emitters/polygon_integral.h"

namespace semblance::surfaces {
namespace {

constexpr double kTiny = 1e-300;       // mm^2; avoids 1 / 0
constexpr double kLostDigits = 1e-13;  // the closed form keeps 1e-16 / 1e-13 = 0.1 % after
                                       // cancellation
// The largest (longest edge / distance)^2 for the centroid rule on one triangle, for powers up to
// 9. A smaller value costs time and gains accuracy.
constexpr double kCentroidShare = 0.02;

// A quadrature point, centroid + ab u + ac v, and its weight.
struct Sample {
  double u, v, weight;
};

// Appends three symmetric points: two barycentric coordinates are `corner`, the third is 1 - 2
// corner.
constexpr void Append(double corner, double weight, Sample*& to) {
  const double third = 1.0 / 3, other = 1 - 2 * corner;
  *to++ = {corner - third, corner - third, weight};
  *to++ = {other - third, corner - third, weight};
  *to++ = {corner - third, other - third, weight};
}

// Quadrature rules of degree 4 (six points) and degree 6 (twelve points), Dunavant 1985.
constexpr auto kSix = [] {
  std::array<Sample, 6> samples{};
  Sample* to = samples.data();
  Append(0.445948490915965, 0.223381589678011, to);
  Append(0.091576213509771, 0.109951743655322, to);
  return samples;
}();
constexpr auto kTwelve = [] {
  std::array<Sample, 12> samples{};
  Sample* to = samples.data();
  Append(0.249286745170910, 0.116786275726379, to);
  Append(0.063089014491502, 0.050844906370207, to);
  constexpr double third = 1.0 / 3;
  constexpr std::array<double, 3> corners = {0.310352451033785, 0.053145049844816,
                                             0.636502499121399};
  for (int n = 0; n < 3; ++n) {
    for (int m = 0; m < 3; ++m) {
      if (n != m) {
        *to++ = {corners[n] - third, corners[m] - third, 0.082851075618374};
      }
    }
  }
  return samples;
}();

// The largest (longest edge / distance)^2 for which the centroid with the second derivative, six
// points and twelve points err by less than 1 %, for powers up to 9 (found by experiment).
constexpr std::array<double, 3> kMaxShare = {0.04, 0.35, 0.9};

// The factor of these shares for higher powers, whose integrands are steeper (found by experiment).
double ShareOfPower(double power) { return std::min(1.0, std::pow(9.0 / power, 1.6)); }

// Four lanes, from `first` on, and a point relative to them.
struct Four {
  const FlatEmitterLanes& batch;
  int first;
  Wide dx, dy, dz, r2, inverse2;  // from the centroid to the point
  Wide height, share;             // share: (longest edge / distance)^2

  SEMBLANCE_INLINE Wide Get(const FlatEmitterLanes::Lanes& lanes) const {
    return Load<Wide>(lanes, first);
  }
};

SEMBLANCE_INLINE Four See(const FlatEmitterLanes& b, int first, const Vec3& p) {
  Four seen{b, first, {}, {}, {}, {}, {}, {}, {}};
  seen.dx = p.x() - seen.Get(b.at[0]);
  seen.dy = p.y() - seen.Get(b.at[1]);
  seen.dz = p.z() - seen.Get(b.at[2]);
  seen.r2 =
      Greater<Wide>(seen.dx * seen.dx + seen.dy * seen.dy + seen.dz * seen.dz, All<Wide>(kTiny));
  seen.height = seen.dx * seen.Get(b.normal[0]) + seen.dy * seen.Get(b.normal[1]) +
                seen.dz * seen.Get(b.normal[2]);
  seen.inverse2 = 1 / seen.r2;
  seen.share = seen.Get(b.longest_mm2) * seen.inverse2;
  return seen;
}

// The mean by the value at the centroid plus half the trace of the integrand's Hessian times the
// covariance of the triangle's points. The relative depth adds a mixed term (tilt) and its own
// second-order term (bow).
SEMBLANCE_INLINE Wide MeanFromAfar(const Four& seen, int power) {
  const FlatEmitterLanes& b = seen.batch;
  const Wide along_ab =
      seen.dx * seen.Get(b.ab[0]) + seen.dy * seen.Get(b.ab[1]) + seen.dz * seen.Get(b.ab[2]);
  const Wide along_ac =
      seen.dx * seen.Get(b.ac[0]) + seen.dy * seen.Get(b.ac[1]) + seen.dz * seen.Get(b.ac[2]);
  const Wide along_bc = along_ac - along_ab, inverse2 = seen.inverse2;
  const Wide along2 =
      (along_ab * along_ab + along_ac * along_ac + along_bc * along_bc) * (1.0 / 36);
  Wide bend =
      1 + (0.5 * power) * inverse2 * ((power + 2.0) * along2 * inverse2 - seen.Get(b.spread_mm2));
  if (b.sloped) {
    const Wide tilt = power * inverse2 *
                      (seen.dx * seen.Get(b.tilt_mm[0]) + seen.dy * seen.Get(b.tilt_mm[1]) +
                       seen.dz * seen.Get(b.tilt_mm[2]));
    bend += (power - 3.0) * (tilt + 0.5 * (power - 4) * seen.Get(b.bow));
  }
  return bend * InversePowerFromSquare(seen.r2, power, power);
}

SEMBLANCE_INLINE Wide MeanOfSamples(const Four& seen, std::span<const Sample> samples, int power) {
  const FlatEmitterLanes& b = seen.batch;
  Wide sum{};
  for (const Sample& s : samples) {
    const Wide dx = seen.dx - s.u * seen.Get(b.ab[0]) - s.v * seen.Get(b.ac[0]);
    const Wide dy = seen.dy - s.u * seen.Get(b.ab[1]) - s.v * seen.Get(b.ac[1]);
    const Wide dz = seen.dz - s.u * seen.Get(b.ab[2]) - s.v * seen.Get(b.ac[2]);
    const Wide r2 = Greater<Wide>(dx * dx + dy * dy + dz * dz, All<Wide>(kTiny));
    Wide value = s.weight * InversePowerFromSquare(r2, power, power);
    if (b.sloped) {
      Wide depth = 1 + s.u * seen.Get(b.rise_ab) + s.v * seen.Get(b.rise_ac);
      for (int rest = power - 3; rest > 0; rest >>= 1) {
        value = (rest & 1) != 0 ? value * depth : value;
        depth *= depth;
      }
    }
    sum += value;
  }
  return sum;
}

// The quadratures that four triangles need.
struct Ways {
  unsigned afar, six, twelve;  // != 0 if a lane needs it
  unsigned near;               // bits: lanes that are too near for all three
};

SEMBLANCE_INLINE Ways ChooseWays(const Wide& share, const std::array<double, 3>& most_share) {
  using Bits = std::int64_t __attribute__((vector_size(32)));
  constexpr Bits kLaneBits = {8, 16, 32, 64};
  const Bits in_front = share > 0, beyond_afar = share > All<Wide>(most_share[0]),
             beyond_six = share > All<Wide>(most_share[1]),
             beyond_twelve = share > All<Wide>(most_share[2]);
  const Bits bits = (in_front & ~beyond_afar & 1) | (beyond_afar & ~beyond_six & 2) |
                    (beyond_six & ~beyond_twelve & 4) | (beyond_twelve & kLaneBits);
  std::array<std::uint64_t, kLaneCount<Wide>> of_lane;
  std::memcpy(of_lane.data(), &bits, sizeof bits);
  const auto all = static_cast<unsigned>((of_lane[0] | of_lane[1]) | (of_lane[2] | of_lane[3]));
  return {all & 1, all & 2, all & 4, all >> 3};
}

// Adds the emissions of four lanes and returns the bits of lanes that are too near. fixed: the
// power as a compile-time constant, or 0 to use quadrature.power.
template <int fixed>
SEMBLANCE_INLINE unsigned AddFour(const FlatEmitterLanes& batch, int first, const Vec3& p,
                                  const FlatQuadrature& quadrature, Wide& sum) {
  const int power = fixed > 0 ? fixed : quadrature.power;
  const Four seen = See(batch, first, p);
  const Wide share = seen.height > 0 ? seen.share : Wide{};
  const Ways ways = ChooseWays(share, quadrature.most_share);
  Wide mean{};
  if (ways.afar != 0) {
    mean = share <= All<Wide>(quadrature.most_share[0]) ? MeanFromAfar(seen, power) : mean;
  }
  if (ways.six != 0) {
    const Wide six = MeanOfSamples(seen, kSix, power);
    mean = share > All<Wide>(quadrature.most_share[0]) ? six : mean;
  }
  if (ways.twelve != 0) {
    const Wide twelve = MeanOfSamples(seen, kTwelve, power);
    mean = share > All<Wide>(quadrature.most_share[1]) ? twelve : mean;
  }
  const Wide emission = seen.Get(batch.gain) * seen.height * mean;
  const Wide taken = share > All<Wide>(quadrature.most_share[2]) ? Wide{} : emission;
  sum += share > 0 ? taken : Wide{};
  return ways.near;
}

EdgeFromFoot SeenFrom(const Vec3& p, const Vec3& u, const Vec3& v, const Vec3& out) {
  const Vec3 from = u - p, along = v - u;
  const double inverse = 1 / along.norm(), begin = from.dot(along) * inverse;
  return {from.dot(out) * inverse, begin, begin + 1 / inverse};
}

}  // namespace

void FlatEmitterLanes::Set(int lane, const Vec3& a, const Vec3& b, const Vec3& c,
                           const Vec3& unit_normal, double lane_gain) {
  const Vec3 centroid = (a + b + c) / 3, to_b = b - a, to_c = c - a;
  for (int k = 0; k < 3; ++k) {
    at[k][lane] = centroid[k];
    normal[k][lane] = unit_normal[k];
    ab[k][lane] = to_b[k];
    ac[k][lane] = to_c[k];
  }
  const double bc2 = (c - b).squaredNorm();
  gain[lane] = lane_gain;
  spread_mm2[lane] = (to_b.squaredNorm() + to_c.squaredNorm() + bc2) / 36;
  longest_mm2[lane] = std::max({to_b.squaredNorm(), to_c.squaredNorm(), bc2});
}

void FlatEmitterLanes::SetSlope(int lane, const Vec3& slope) {
  const Vec3 to_b(ab[0][lane], ab[1][lane], ab[2][lane]),
      to_c(ac[0][lane], ac[1][lane], ac[2][lane]);
  sloped = true;
  rise_ab[lane] = to_b.dot(slope);
  rise_ac[lane] = to_c.dot(slope);
  const Vec3 tilt = (to_b * rise_ab[lane] + to_c * rise_ac[lane] +
                     (to_c - to_b) * (rise_ac[lane] - rise_ab[lane])) /
                    36;
  for (int k = 0; k < 3; ++k) {
    tilt_mm[k][lane] = tilt[k];
  }
  bow[lane] = tilt.dot(slope);
}

FlatQuadrature::FlatQuadrature(int of_power) : power(of_power) {
  for (std::size_t n = 0; n < most_share.size(); ++n) {
    most_share[n] = ShareOfPower(power) * kMaxShare[n];
  }
}

SEMBLANCE_WIDE void AddFlat(std::span<const FlatEmitterLanes> batches,
                            std::span<const std::int32_t> runs, const Vec3& p,
                            const FlatQuadrature& quadrature, FlatWalk& walk) {
  constexpr int kDefaultPower = 9;  // of the default decay
  Wide sum = Load<Wide>(walk.sum, 0);
  walk.near = 0;
  while (walk.next < runs.size() && walk.near == 0) {
    const std::int32_t run = runs[walk.next++];
    const FlatEmitterLanes& batch = batches[run / 2];
    const int first = run % 2 * kLaneCount<Wide>;
    walk.near = quadrature.power == kDefaultPower
                    ? AddFour<kDefaultPower>(batch, first, p, quadrature, sum)
                    : AddFour<0>(batch, first, p, quadrature, sum);
  }
  Store(sum, walk.sum, 0);
}

FlatKernel::FlatKernel(const FlatEmitter& o)
    : decay_(o.decay),
      closed_(o.decay == std::floor(o.decay) ? static_cast<int>(o.decay) + 1 : -1),
      flat_share_(closed_ > 0 ? std::pow(kLostDigits, 2.0 / closed_) : 0),
      centroid_share_(ShareOfPower(o.decay + 3) * kCentroidShare),
      part_share_(ShareOfPower(o.decay + 3) * kMaxShare[2]),
      falloff_(MakeFalloff(o.decay + 3, true, 0)),
      quadrature_(std::max(closed_, 1) + 2) {}

double FlatKernel::Gain(const EmitterTriangle& t) const {
  return (decay_ + 1) / (2 * std::numbers::pi) * std::pow(t.depth_mm, decay_) * t.area_mm2;
}

std::vector<FlatEmitterLanes> FlatKernel::MakeLanes(
    std::span<const EmitterTriangle> emitters) const {
  constexpr std::size_t kLanes = FlatEmitterLanes::kLanes;
  std::vector<FlatEmitterLanes> lanes((emitters.size() + kLanes - 1) / kLanes);
  for (std::size_t e = 0; e < emitters.size(); ++e) {
    const EmitterTriangle& t = emitters[e];
    const int lane = static_cast<int>(e % kLanes);
    lanes[e / kLanes].Set(lane, t.a, t.b, t.c, t.normal, t.gain);
    if (t.IsSloped()) {
      lanes[e / kLanes].SetSlope(lane, t.slope);
    }
  }
  return lanes;
}

double FlatKernel::Sum(std::span<const FlatEmitterLanes> lanes, std::span<const std::int32_t> runs,
                       std::span<const EmitterTriangle> emitters, const Vec3& p) const {
  FlatWalk walk;
  while (walk.next < runs.size()) {
    AddFlat(lanes, runs, p, quadrature_, walk);
    for (unsigned near = walk.near; near != 0; near &= near - 1) {
      const int lane = std::countr_zero(near);
      const EmitterTriangle& t = emitters[kRun * runs[walk.next - 1] + lane];
      walk.sum[lane] += Emission(t, p, (p - t.a).dot(t.normal));
    }
  }
  return (walk.sum[0] + walk.sum[1]) + (walk.sum[2] + walk.sum[3]);
}

double FlatKernel::Emission(const EmitterTriangle& t, const Vec3& p, double height) const {
  const double r2 = (p - t.centroid).squaredNorm();
  if (t.longest2_mm2 <= centroid_share_ * r2) {
    const double far = t.gain * height * falloff_.InversePower(r2);
    return std::min(far * FarShare(t, p - t.centroid, r2), kMaxEmission);
  }
  const double counted = std::max(height, Lowest(t));
  if (closed_ < 0 || counted * counted < flat_share_ * r2) {
    return std::min(t.gain * height * Mean(t, p, t.a, t.b, t.c, t.longest2_mm2), kMaxEmission);
  }
  const double integral = ClosedForm(t, p, counted);
  return std::min(t.gain * height * integral / t.area_mm2, kMaxEmission);
}

double FlatKernel::Above(const EmitterTriangle& t, double depth_share, double height,
                         double distance) const {
  const double gain = depth_share == 1 ? t.gain : t.gain * std::pow(depth_share, decay_);
  return std::min(gain * height * falloff_.InversePower(distance * distance), kMaxEmission);
}

double FlatKernel::Lowest(const EmitterTriangle& t) const { return std::sqrt(t.Floor2(1)); }

double FlatKernel::Lowered(const EmitterTriangle& t, double distance) const {
  return std::sqrt(distance * distance + t.Floor2(1));
}

double FlatKernel::ClosedForm(const EmitterTriangle& t, const Vec3& p, double height) const {
  const std::array<EdgeFromFoot, 3> edges = {SeenFrom(p, t.a, t.b, t.edge_normal_a),
                                             SeenFrom(p, t.b, t.c, t.edge_normal_b),
                                             SeenFrom(p, t.c, t.a, t.edge_normal_c)};
  const double integral = IntegrateInversePower(edges, height, closed_);
  if (!t.IsSloped()) {
    return integral;
  }
  // R^-(n+2) (q - foot) is the gradient of -R^-n / n. Hence the first moment is an integral over
  // edges.
  const std::array<const Vec3*, 3> outward = {&t.edge_normal_a, &t.edge_normal_b, &t.edge_normal_c};
  double moment = 0;  // first moment along the slope
  for (int e = 0; e < 3; ++e) {
    moment -= outward[e]->dot(t.slope) / (edges[e].end - edges[e].begin) *
              IntegrateAlong(edges[e], height, closed_) / closed_;
  }
  return integral * Weight(t, (p - t.centroid).dot(t.slope) + moment / integral);
}

// (Relative depth)^k at the relative depth 1 + rise. Evaluated at the integrand's centroid it is
// correct for a linear depth to second order.
double FlatKernel::Weight(const EmitterTriangle& t, double rise) const {
  return std::pow(std::clamp(1 + rise, t.least_share, t.most_share), decay_);
}

// The mean over a distant triangle relative to the value at its centroid, from the integrand's
// second derivative and the depth's weight. from: from the centroid to the point.
double FlatKernel::FarShare(const EmitterTriangle& t, const Vec3& from, double r2) const {
  const double power = falloff_.power;
  double along2 = 0, spread = 0, nearer = 0, rise2 = 0;
  for (const Vec3& edge : {Vec3(t.b - t.a), Vec3(t.c - t.b), Vec3(t.a - t.c)}) {
    const double along = from.dot(edge), rise = edge.dot(t.slope);
    along2 += along * along / 36;
    spread += edge.squaredNorm() / 36;
    nearer += along * rise / 36;
    rise2 += rise * rise / 36;
  }
  const double bend = 0.5 * power / r2 * ((power + 2) * along2 / r2 - spread);
  return 1 + bend + decay_ * (power * nearer / r2 + 0.5 * (decay_ - 1) * rise2);
}

// The mean of |p - q|^-(k+3), weighted by (relative depth)^k, over the part abc of a triangle, by
// twelve points of each of its parts that is small against its distance.
double FlatKernel::Mean(const EmitterTriangle& t, const Vec3& p, const Vec3& a, const Vec3& b,
                        const Vec3& c, double longest2) const {
  const double floor2 = t.Floor2(1);
  const Vec3 centroid = (a + b + c) / 3;
  const double r2 = std::max((p - centroid).squaredNorm(), floor2);
  if (longest2 <= part_share_ * r2) {
    double sum = 0;
    for (const Sample& s : kTwelve) {
      const Vec3 q = centroid + s.u * (b - a) + s.v * (c - a);
      const double value = falloff_.InversePower(std::max((p - q).squaredNorm(), floor2));
      sum += s.weight * (t.IsSloped() ? value * Weight(t, (q - t.centroid).dot(t.slope)) : value);
    }
    return sum;
  }
  const Vec3 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
  const double quarter = longest2 / 4;
  return (Mean(t, p, a, ab, ca, quarter) + Mean(t, p, ab, b, bc, quarter) +
          Mean(t, p, ca, bc, c, quarter) + Mean(t, p, ab, bc, ca, quarter)) /
         4;
}

}  // namespace semblance::surfaces
