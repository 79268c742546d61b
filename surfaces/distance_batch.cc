// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/distance_batch.h"

#include <algorithm>
#include <cmath>

#include "surfaces/wide.h"

namespace semblance {
namespace {

// Some lanes, from `first` on, seen from a point: in the plane, over it, and where they emit from.
template <int count>
struct Seen {
  std::array<double, count> x{}, y{}, z{};
  std::array<double, count> beside2{};  // squared distance in the plane to the triangle's border
  std::array<double, count> over{};     // 1 over the triangle, else 0
};

template <int count>
SEMBLANCE_INLINE void See(const DistanceBatch& b, int first, const Vec3& p, Seen<count>& seen) {
  const double px = p.x(), py = p.y(), pz = p.z();
  for (int n = 0; n < count; ++n) {
    const int l = first + n;
    const double dx = px - b.corner[0][l], dy = py - b.corner[1][l], dz = pz - b.corner[2][l];
    seen.x[n] = dx * b.along[0][l] + dy * b.along[1][l] + dz * b.along[2][l];
    seen.y[n] = dx * b.across[0][l] + dy * b.across[1][l] + dz * b.across[2][l];
    seen.z[n] = dx * b.normal[0][l] + dy * b.normal[1][l] + dz * b.normal[2][l];
  }
  for (int n = 0; n < count; ++n) {
    const int l = first + n;
    const double x = seen.x[n], y = seen.y[n];
    const double beyond_ab = x - std::min(std::max(x, 0.0), b.ab.length[l]);
    const double u = x * b.ac.x[l] + y * b.ac.y[l], left_of_ac = y * b.ac.x[l] - x * b.ac.y[l];
    const double beyond_ac = u - std::min(std::max(u, 0.0), b.ac.length[l]);
    const double from_b = x - b.ab.length[l];
    const double v = from_b * b.bc.x[l] + y * b.bc.y[l],
                 left_of_bc = y * b.bc.x[l] - from_b * b.bc.y[l];
    const double beyond_bc = v - std::min(std::max(v, 0.0), b.bc.length[l]);
    seen.beside2[n] = std::min(beyond_ab * beyond_ab + y * y,
                               std::min(beyond_ac * beyond_ac + left_of_ac * left_of_ac,
                                        beyond_bc * beyond_bc + left_of_bc * left_of_bc));
    seen.over[n] = std::min(y, std::min(-left_of_ac, left_of_bc)) >= 0 ? 1.0 : 0.0;
  }
}

// square^(-decay / 2).
template <int count>
SEMBLANCE_INLINE void InversePowers(const DistanceFall& fall,
                                    const std::array<double, count>& square,
                                    std::array<double, count>& value) {
  if (fall.whole < 0) {
    for (int n = 0; n < count; ++n) {
      value[n] = std::pow(square[n], -0.5 * fall.decay);
    }
    return;
  }
  std::array<double, count> power{};
  const bool odd = (fall.whole & 1) != 0;
  for (int n = 0; n < count; ++n) {
    power[n] = 1 / square[n];
  }
  for (int n = 0; n < count; ++n) {
    value[n] = odd ? std::sqrt(power[n]) : 1;
  }
  for (int rest = fall.whole >> 1; rest != 0; rest >>= 1) {
    const bool taken = (rest & 1) != 0;
    for (int n = 0; n < count; ++n) {
      value[n] *= taken ? power[n] : 1;
      power[n] *= power[n];
    }
  }
}

template <int count>
SEMBLANCE_INLINE void Emit(const DistanceBatch& b, int first, const Vec3& p,
                           const DistanceFall& fall, double* emission) {
  Seen<count> seen;
  See<count>(b, first, p, seen);
  std::array<double, count> square{}, value{};
  for (int n = 0; n < count; ++n) {
    const double beside2 = seen.over[n] > 0 ? 0 : seen.beside2[n];
    square[n] = std::max(seen.z[n] * seen.z[n] + beside2, b.floor_mm2[first + n]);
  }
  InversePowers<count>(fall, square, value);
  for (int n = 0; n < count; ++n) {
    const int l = first + n;
    const double falling = b.gain[l] * value[n];
    const double beyond = falling < fall.cut ? 0 : std::min(falling, fall.most);
    const double solid = seen.over[n] > 0 ? fall.most : 0;
    const double either = seen.z[n] < 0 ? solid : beyond;
    emission[n] = seen.z[n] + b.advance_mm[l] > 0 ? either : 0;
  }
}

}  // namespace

void DistanceBatch::Set(int lane, const Vec3& a, const Vec3& b, const Vec3& c,
                        const Vec3& unit_normal, double advance, double floor, double lane_gain) {
  const Vec3 x_axis = (b - a).normalized(), y_axis = unit_normal.cross(x_axis);
  const Vec3 moved = a + advance * unit_normal;
  for (int k = 0; k < 3; ++k) {
    corner[k][lane] = moved[k];
    along[k][lane] = x_axis[k];
    across[k][lane] = y_axis[k];
    normal[k][lane] = unit_normal[k];
  }
  const auto set = [&](Edge& edge, const Vec3& from, const Vec3& to) {
    const Vec3 direction = (to - from).normalized();
    edge.x[lane] = direction.dot(x_axis);
    edge.y[lane] = direction.dot(y_axis);
    edge.length[lane] = (to - from).norm();
  };
  set(ab, a, b);
  set(ac, a, c);
  set(bc, b, c);
  advance_mm[lane] = advance;
  floor_mm2[lane] = floor * floor;
  gain[lane] = lane_gain;
}

SEMBLANCE_WIDE void EmitByDistance(const DistanceBatch& batch, const Vec3& p,
                                   const DistanceFall& fall, DistanceBatch::Lanes& emission) {
  Emit<DistanceBatch::kLanes>(batch, 0, p, fall, emission.data());
}

double EmitByDistance(const DistanceBatch& batch, int lane, const Vec3& p,
                      const DistanceFall& fall) {
  double emission = 0;
  Emit<1>(batch, lane, p, fall, &emission);
  return emission;
}

}  // namespace semblance
