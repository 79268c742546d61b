// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/emitter_multipole.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "surfaces/base/simd.h"

namespace semblance::surfaces {
namespace {

// Calls visit(x, mass) for four points with the same moments, up to the second, as the triangle
// abc.
template <class Visit>
void ForEachPoint(const Vec3& a, const Vec3& b, const Vec3& c, double mass, const Visit& visit) {
  visit(Vec3((a + b + c) / 3), 0.75 * mass);
  for (const Vec3& corner : {a, b, c}) {
    visit(corner, mass / 12);
  }
}

// The same for an emitter with the mass gain * (relative depth)^decay, in four parts if the depth
// is linear.
template <class Visit>
void ForEachPoint(const EmitterTriangle& t, int decay, const Visit& visit) {
  if (!t.IsSloped()) {
    ForEachPoint(t.a, t.b, t.c, t.gain, visit);
    return;
  }
  const auto weighted = [&](const Vec3& x, double mass) {
    const double share = 1 + (x - t.centroid).dot(t.slope);
    visit(x, mass * std::pow(std::clamp(share, t.least_share, t.most_share), decay));
  };
  const Vec3 ab = 0.5 * (t.a + t.b), bc = 0.5 * (t.b + t.c), ca = 0.5 * (t.c + t.a);
  ForEachPoint(t.a, ab, ca, t.gain / 4, weighted);
  ForEachPoint(ab, t.b, bc, t.gain / 4, weighted);
  ForEachPoint(ca, bc, t.c, t.gain / 4, weighted);
  ForEachPoint(ab, bc, ca, t.gain / 4, weighted);
}

// Calls visit(t, x, mass) for all points of all emitters.
template <class Visit>
void ForEachPoint(std::span<const EmitterTriangle> emitters, int decay, const Visit& visit) {
  for (const EmitterTriangle& t : emitters) {
    ForEachPoint(t, decay, [&](const Vec3& x, double mass) { visit(t, x, mass); });
  }
}

// The centroid, with emitters weighted by n.N, moved along N so that the sum of gain n.(x - center)
// is 0.
Vec3 FindCenter(std::span<const EmitterTriangle> emitters, int decay, const Vec3& gain_normal) {
  const double gain = gain_normal.norm();
  const Vec3 normal = gain_normal / gain;
  Vec3 center = Vec3::Zero();
  double along = 0;
  ForEachPoint(emitters, decay, [&](const EmitterTriangle& t, const Vec3& x, double mass) {
    center += mass * t.normal.dot(normal) / gain * x;
    along += mass * t.normal.dot(x) / gain;
  });
  return center + (along - normal.dot(center)) * normal;
}

// Moments about the center; second[i] is weighted by gain n_i.
struct Moments {
  Mat3 first = Mat3::Zero();
  std::array<Mat3, 3> second = {Mat3::Zero(), Mat3::Zero(), Mat3::Zero()};
};

Moments ComputeMoments(std::span<const EmitterTriangle> emitters, int decay, const Vec3& center) {
  Moments moments;
  ForEachPoint(emitters, decay, [&](const EmitterTriangle& t, const Vec3& x, double mass) {
    const Vec3 y = x - center;
    const Mat3 square = mass * y * y.transpose();
    moments.first += mass * t.normal * y.transpose();
    for (int i = 0; i < 3; ++i) {
      moments.second[i] += t.normal[i] * square;
    }
  });
  return moments;
}

// Bounds the part of the second order that gain_normal and spread do not represent.
double SecondOrderLeft(const Moments& moments, const EmitterMultipole& multipole, int power) {
  double all2 = 0;
  Vec3 traces, cross = Vec3::Zero();
  for (int i = 0; i < 3; ++i) {
    const Mat3 left = moments.second[i] - multipole.gain_normal[i] * multipole.spread_mm2;
    all2 += left.squaredNorm();
    traces[i] = left.trace();
    cross += moments.second[i].row(i).transpose();
  }
  return 0.5 * power * (traces.norm() + (power + 2) * std::sqrt(all2)) + power * cross.norm();
}

// Sets the bounds that depend on each emitter's furthest corner.
void SetBounds(std::span<const EmitterTriangle> emitters, int decay, EmitterMultipole& multipole) {
  multipole.radius_mm = 0;
  for (const EmitterTriangle& t : emitters) {
    const double plane_mm = std::abs(t.normal.dot(t.a - multipole.center));
    double furthest_mm = 0;
    for (const Vec3& corner : {t.a, t.b, t.c}) {
      furthest_mm = std::max(furthest_mm, (corner - multipole.center).norm());
    }
    double square = 0;
    ForEachPoint(t, decay, [&](const Vec3& x, double mass) {
      square += mass * (x - multipole.center).squaredNorm();
    });
    multipole.radius_mm = std::max(multipole.radius_mm, furthest_mm);
    multipole.plane_mm = std::max(multipole.plane_mm, plane_mm);
    multipole.tilt =
        std::max(multipole.tilt, (t.normal - multipole.gain_normal.normalized()).norm());
    multipole.third += furthest_mm * square;
    multipole.third_by_plane += plane_mm * square;
  }
}

}  // namespace

EmitterMultipole MakeMultipole(std::span<const EmitterTriangle> emitters, int decay) {
  EmitterMultipole multipole;
  ForEachPoint(emitters, decay, [&](const EmitterTriangle& t, const Vec3&, double mass) {
    multipole.gain_normal += mass * t.normal;
    multipole.gain += mass;
  });
  const double facing = multipole.gain_normal.norm();
  if (!(facing > 0)) {
    return multipole;
  }
  multipole.center = FindCenter(emitters, decay, multipole.gain_normal);
  const Moments moments = ComputeMoments(emitters, decay, multipole.center);
  for (int i = 0; i < 3; ++i) {
    multipole.spread_mm2 += multipole.gain_normal[i] / (facing * facing) * moments.second[i];
  }
  const int power = decay + 3;
  multipole.first = power * (0.5 * (moments.first + moments.first.transpose())).norm();
  multipole.second = SecondOrderLeft(moments, multipole, power);
  SetBounds(emitters, decay, multipole);
  return multipole;
}

MultipoleLanes::MultipoleLanes() {
  for (Lanes& lanes : at) {
    lanes.fill(1e100);
  }
}

void MultipoleLanes::Set(int lane, const EmitterMultipole& multipole, int power) {
  const double half = 0.5 * power * (power + 2);
  const bool usable = std::isfinite(multipole.radius_mm);
  const Vec3 facing = multipole.gain_normal.normalized();
  for (int k = 0; k < 3; ++k) {
    at[k][lane] = usable ? multipole.center[k] : 0;
    gain_normal[k][lane] = multipole.gain_normal[k];
    normal[k][lane] = facing[k];
    bend[k][lane] = half * multipole.spread_mm2(k, k);
    bend[3 + k][lane] = 2 * half * multipole.spread_mm2(k == 2 ? 1 : 0, k == 0 ? 1 : 2);
  }
  fade[lane] = 0.5 * power * multipole.spread_mm2.trace();
  radius_mm[lane] = multipole.radius_mm;
  plane_mm[lane] = multipole.plane_mm;
  tilt[lane] = multipole.tilt;
  gain[lane] = multipole.gain;
  first[lane] = multipole.first;
  second[lane] = multipole.second;
  third[lane] = multipole.third;
  third_by_plane[lane] = multipole.third_by_plane;
}

// The coefficients of |p - x|^-power in powers of |x - center| / |p - center| are Gegenbauer
// polynomials of the cosine, at most (power + j - 1 over j), so that each bound is at most `next`
// times the one before. Heights over the planes differ by at most `apart` from the height over the
// plane through the center. Hence, if p may be in front of some planes only, all heights are at
// most 2 `apart`.
SEMBLANCE_WIDE double MultipoleLanes::ErrorInBox(const Vec3& box_center, const Vec3& half,
                                                 int power) const {
  const auto load = [](const Lanes& lanes) { return Load<Wide>(lanes, 0); };
  Wide nearest2{}, furthest2{}, over{}, reach{};
  for (int axis = 0; axis < 3; ++axis) {
    const Wide from = box_center[axis] - load(at[axis]), facing = load(normal[axis]);
    const Wide least = Greater<Wide>(Magnitude(from) - half[axis], Wide{}),
               most = Magnitude(from) + half[axis];
    nearest2 += least * least;
    furthest2 += most * most;
    over += facing * from;
    reach += Magnitude(facing) * half[axis];
  }
  const Wide nearest = SquareRoot(nearest2), inverse = 1 / nearest,
             beyond = nearest - load(radius_mm);
  const Wide apart = load(tilt) * nearest + load(plane_mm),
             furthest_apart = load(tilt) * SquareRoot(furthest2) + load(plane_mm);
  const Wide next = (power + 2) / 3.0 * load(radius_mm) * inverse;
  const Wide second_up = power * (power + 1) / 2.0 / (1 - next),
             third_up = (power + 2) / 3.0 * second_up;
  const Wide height =
      Smaller<Wide>((over + reach + furthest_apart + load(plane_mm)) * inverse, All<Wide>(1));
  const Wide of_third = load(third) * height * third_up + load(third_by_plane) * second_up;
  const Wide in_front = InversePowerFromSquare(nearest2, power, power) *
                        (load(first) + inverse * (load(second) + inverse * of_third));
  const Wide of_some =
      2 * apart * load(gain) * InversePowerFromSquare<Wide>(beyond * beyond, power, power);
  const Wide error = over - reach >= furthest_apart ? in_front : Greater(in_front, of_some);
  const Wide usable = next < 1 ? error : All<Wide>(std::numeric_limits<double>::infinity());
  Lanes errors;
  Store(usable, errors, 0);
  return (1 + kRounding) * ((errors[0] + errors[1]) + (errors[2] + errors[3]));
}

SEMBLANCE_WIDE double SumMultipoles(std::span<const MultipoleLanes> lanes,
                                    std::span<const std::int32_t> which, const Vec3& p, int power) {
  constexpr int kDefaultPower = 9;  // of the default decay
  Wide sum{};
  for (const std::int32_t n : which) {
    const MultipoleLanes& b = lanes[n];
    const auto load = [](const MultipoleLanes::Lanes& of) { return Load<Wide>(of, 0); };
    const Wide x = p.x() - load(b.at[0]), y = p.y() - load(b.at[1]), z = p.z() - load(b.at[2]);
    const Wide r2 = x * x + y * y + z * z, inverse2 = 1 / r2;
    const Wide facing =
        x * load(b.gain_normal[0]) + y * load(b.gain_normal[1]) + z * load(b.gain_normal[2]);
    const Wide along2 = x * (x * load(b.bend[0]) + y * load(b.bend[3]) + z * load(b.bend[4])) +
                        y * (y * load(b.bend[1]) + z * load(b.bend[5])) + z * z * load(b.bend[2]);
    const Wide order2 = inverse2 * (along2 * inverse2 - load(b.fade));
    const Wide fall = power == kDefaultPower
                          ? InversePowerFromSquare(r2, kDefaultPower, kDefaultPower)
                          : InversePowerFromSquare(r2, power, power);
    sum += Greater(facing, Wide{}) * fall * (1 + order2);
  }
  MultipoleLanes::Lanes sums;
  Store(sum, sums, 0);
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

}  // namespace semblance::surfaces
