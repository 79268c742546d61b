// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/distance_batch.h"

#include <algorithm>
#include <cmath>

#include "surfaces/wide.h"

namespace semblance {
namespace {

// Some lanes, from `first` on, seen from a point: over the plane, and where they emit from.
template <class N>
struct Seen {
  N z{};
  N beside2{};  // squared distance in the plane to the triangle's border
  N within{};   // >= 0 over the triangle
};

template <class N>
SEMBLANCE_INLINE Seen<N> See(const DistanceBatch& b, int first, const Vec3& p) {
  const auto load = [first](const DistanceBatch::Lanes& lanes) { return Load<N>(lanes, first); };
  const N dx = p.x() - load(b.corner[0]), dy = p.y() - load(b.corner[1]),
          dz = p.z() - load(b.corner[2]);
  const N x = dx * load(b.along[0]) + dy * load(b.along[1]) + dz * load(b.along[2]);
  const N y = dx * load(b.across[0]) + dy * load(b.across[1]) + dz * load(b.across[2]);
  const N ab = load(b.ab.length), beyond_ab = x - Smaller(Greater(x, N{}), ab);
  const N u = x * load(b.ac.x) + y * load(b.ac.y), left_of_ac = y * load(b.ac.x) - x * load(b.ac.y);
  const N beyond_ac = u - Smaller(Greater(u, N{}), load(b.ac.length));
  const N from_b = x - ab;
  const N v = from_b * load(b.bc.x) + y * load(b.bc.y),
          left_of_bc = y * load(b.bc.x) - from_b * load(b.bc.y);
  const N beyond_bc = v - Smaller(Greater(v, N{}), load(b.bc.length));
  return {dx * load(b.normal[0]) + dy * load(b.normal[1]) + dz * load(b.normal[2]),
          Smaller<N>(beyond_ab * beyond_ab + y * y,
                     Smaller<N>(beyond_ac * beyond_ac + left_of_ac * left_of_ac,
                                beyond_bc * beyond_bc + left_of_bc * left_of_bc)),
          Smaller(y, Smaller<N>(-left_of_ac, left_of_bc))};
}

template <class N>
SEMBLANCE_INLINE N Emit(const DistanceBatch& b, int first, const Vec3& p, const DistanceFall& fall,
                        int whole) {
  const Seen<N> seen = See<N>(b, first, p);
  const N nothing{}, most = All<N>(fall.most);
  const N beside2 = seen.within >= 0 ? nothing : seen.beside2;
  const N square = Greater<N>(seen.z * seen.z + beside2, Load<N>(b.floor_mm2, first));
  const N falling = Load<N>(b.gain, first) * InversePowerOf(square, fall.decay, whole);
  const N beyond = falling < fall.cut ? nothing : Smaller(falling, most);
  const N solid = seen.within >= 0 ? most : nothing;
  const N either = seen.z < 0 ? solid : beyond;
  return seen.z + Load<N>(b.advance_mm, first) > 0 ? either : nothing;
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
  for (int first = 0; first < DistanceBatch::kLanes; first += kWidth<Wide>) {
    Store(Emit<Wide>(batch, first, p, fall, fall.whole), emission, first);
  }
}

SEMBLANCE_WIDE double SumByDistance(std::span<const DistanceBatch> batches,
                                    std::span<const std::int32_t> runs, const Vec3& p,
                                    const DistanceFall& fall) {
  constexpr int kUsual = 6;  // the default decay
  Wide sum{};
  for (const std::int32_t run : runs) {
    const DistanceBatch& batch = batches[run / 2];
    const int first = run % 2 * kWidth<Wide>;
    sum += fall.whole == kUsual ? Emit<Wide>(batch, first, p, fall, kUsual)
                                : Emit<Wide>(batch, first, p, fall, fall.whole);
  }
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

double EmitByDistance(const DistanceBatch& batch, int lane, const Vec3& p,
                      const DistanceFall& fall) {
  return Emit<double>(batch, lane, p, fall, fall.whole);
}

}  // namespace semblance
