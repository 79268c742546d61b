// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/distance_batch.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "surfaces/emitters/simd.h"

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

// Appends to `found` those of some batches, at most eight, that reach p; without a branch that
// could be guessed wrong. Writes one more than it appends.
SEMBLANCE_INLINE std::int32_t* AppendReaching(std::span<const std::int32_t> which,
                                              const EightReaches& reaches, const Vec3& p,
                                              std::int32_t* found) {
  Wider squared{};
  for (int axis = 0; axis < 3; ++axis) {
    const Wider from = p[axis] - Load<Wider>(reaches.center[axis], 0);
    squared += from * from;
  }
  const auto reach = squared <= Load<Wider>(reaches.squared_mm2, 0);  // -1 or 0, a lane
  std::array<std::int64_t, DistanceBatch::kLanes> minus;
  static_assert(sizeof(reach) == sizeof(minus));
  std::memcpy(minus.data(), &reach, sizeof(minus));
  for (std::size_t n = 0; n < which.size(); ++n) {
    *found = which[n];
    found -= minus[n];
  }
  return found;
}

BatchReach ReachOf(const DistanceBatch& batch, const DistanceFall& fall) {
  constexpr double kSlack = 1 + 1e-9;
  const auto at = [](const std::array<DistanceBatch::Lanes, 3>& lanes, int l) {
    return Vec3(lanes[0][l], lanes[1][l], lanes[2][l]);
  };
  Box3 box;
  double furthest_mm = 0;  // from a triangle: where it emits, or is solid
  for (int l = 0; l < DistanceBatch::kLanes && batch.gain[l] > 0; ++l) {
    const Vec3 a = at(batch.corner, l), x = at(batch.along, l), y = at(batch.across, l);
    box.extend(a).extend(a + batch.ab.length[l] * x);
    box.extend(a + batch.ac.length[l] * (batch.ac.x[l] * x + batch.ac.y[l] * y));
    const double emitting_mm = std::pow(batch.gain[l] / fall.cut, 1 / fall.decay);
    furthest_mm = std::max({furthest_mm, emitting_mm, batch.advance_mm[l]});
  }
  if (box.isEmpty()) {
    return {};
  }
  const double radius_mm = 0.5 * box.diagonal().norm() + furthest_mm;
  return {box.center(), kSlack * radius_mm * radius_mm};
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
  Store(Emit<Wider>(batch, 0, p, fall, fall.whole), emission, 0);
}

std::vector<BatchReach> ReachesOf(std::span<const DistanceBatch> batches,
                                  const DistanceFall& fall) {
  std::vector<BatchReach> reaches;
  for (const DistanceBatch& batch : batches) {
    reaches.push_back(ReachOf(batch, fall));
  }
  return reaches;
}

std::vector<EightReaches> SideBySide(std::span<const BatchReach> reaches,
                                     std::span<const std::int32_t> which) {
  constexpr std::size_t kLanes = DistanceBatch::kLanes;
  std::vector<EightReaches> eights((which.size() + kLanes - 1) / kLanes);
  for (std::size_t n = 0; n < which.size(); ++n) {
    const BatchReach& reach = reaches[which[n]];
    EightReaches& eight = eights[n / kLanes];
    for (int axis = 0; axis < 3; ++axis) {
      eight.center[axis][n % kLanes] = reach.center[axis];
    }
    eight.squared_mm2[n % kLanes] = reach.squared_mm2;
  }
  return eights;
}

SEMBLANCE_WIDE double SumByDistance(std::span<const DistanceBatch> batches,
                                    std::span<const std::int32_t> which,
                                    std::span<const EightReaches> reaches, const Vec3& p,
                                    const DistanceFall& fall, std::int64_t& reaching) {
  constexpr int kUsual = 6;  // the default decay
  constexpr std::size_t kLanes = DistanceBatch::kLanes, kAtOnce = 32;
  std::array<std::int32_t, kLanes * kAtOnce + 1> found;
  Wider sum{};
  for (std::size_t begin = 0; begin < reaches.size(); begin += kAtOnce) {
    std::int32_t* end = found.data();
    for (std::size_t n = begin; n < std::min(begin + kAtOnce, reaches.size()); ++n) {
      const auto rest = which.subspan(kLanes * n);
      end = AppendReaching(rest.first(std::min(kLanes, rest.size())), reaches[n], p, end);
    }
    for (const std::int32_t* n = found.data(); n != end; ++n) {
      const DistanceBatch& batch = batches[*n];
      sum += fall.whole == kUsual ? Emit<Wider>(batch, 0, p, fall, kUsual)
                                  : Emit<Wider>(batch, 0, p, fall, fall.whole);
    }
    reaching += end - found.data();
  }
  DistanceBatch::Lanes lanes;
  Store(sum, lanes, 0);
  return ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) +
         ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
}

double EmitByDistance(const DistanceBatch& batch, int lane, const Vec3& p,
                      const DistanceFall& fall) {
  return Emit<double>(batch, lane, p, fall, fall.whole);
}

}  // namespace semblance
