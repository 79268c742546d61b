// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/distance_kernel.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "surfaces/base/simd.h"

namespace semblance::surfaces {
namespace {

// A point relative to the lanes from `first` on.
template <class N>
struct SeenTriangle {
  N z{};        // height over the plane of emission
  N beside2{};  // squared distance within the plane to the triangle's border
  N within{};   // >= 0 if the foot lies in the triangle
};

template <class N>
SEMBLANCE_INLINE SeenTriangle<N> See(const DistanceEmitterLanes& b, int first, const Vec3& p) {
  const auto load = [first](const DistanceEmitterLanes::Lanes& lanes) {
    return Load<N>(lanes, first);
  };
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
SEMBLANCE_INLINE N Emit(const DistanceEmitterLanes& b, int first, const Vec3& p,
                        const Falloff& falloff, int whole) {
  const SeenTriangle<N> seen = See<N>(b, first, p);
  const N nothing{}, most = All<N>(kMaxEmission);
  const N beside2 = seen.within >= 0 ? nothing : seen.beside2;
  const N square = Greater<N>(seen.z * seen.z + beside2, Load<N>(b.floor_mm2, first));
  const N falling = Load<N>(b.gain, first) * InversePowerFromSquare(square, falloff.power, whole);
  const N beyond = falling < falloff.cut ? nothing : Smaller(falling, most);
  const N solid = seen.within >= 0 ? most : nothing;
  const N either = seen.z < 0 ? solid : beyond;
  return seen.z + Load<N>(b.advance_mm, first) > 0 ? either : nothing;
}

constexpr int kHalf = DistanceEmitterLanes::kLanes / 2;
// Number of registers of type N per batch of lanes.
template <class N>
constexpr unsigned kParts = DistanceEmitterLanes::kLanes / kLaneCount<N>;

// Returns -1 for each of eight balls that contains p, and 0 for the others.
template <class N>
SEMBLANCE_INLINE std::array<std::int64_t, DistanceEmitterLanes::kLanes> Reaching(
    const ReachLanes& reaches, const Vec3& p) {
  std::array<std::int64_t, DistanceEmitterLanes::kLanes> minus;
  for (int first = 0; first < DistanceEmitterLanes::kLanes; first += kLaneCount<N>) {
    N squared{};
    for (int axis = 0; axis < 3; ++axis) {
      const N from = p[axis] - Load<N>(reaches.center[axis], first);
      squared += from * from;
    }
    const auto reach = squared <= Load<N>(reaches.squared_mm2, first);
    static_assert(sizeof(reach) == kLaneCount<N> * sizeof(minus[0]));
    std::memcpy(minus.data() + first, &reach, sizeof(reach));
  }
  return minus;
}

struct Summands {
  std::span<const DistanceEmitterLanes> batches;
  std::span<const std::int32_t> which;
  std::span<const ReachLanes> reaches;
  const Falloff& falloff;
};

// Appends to `found` the parts of at most four batches that reach p; batch b has the parts from
// kParts * b on. Adds to `halves` the number of balls that reach p. The code has no branches, which
// the processor could mispredict, and therefore writes one entry more than it appends.
template <class N>
SEMBLANCE_INLINE std::uint32_t* AppendReaching(std::span<const std::int32_t> which,
                                               const ReachLanes& reaches, const Vec3& p,
                                               std::int64_t& halves, std::uint32_t* found) {
  const auto minus = Reaching<N>(reaches, p);
  for (std::size_t n = 0; n < which.size(); ++n) {
    const std::int64_t lower = minus[2 * n], upper = minus[2 * n + 1];
    halves -= lower + upper;
    const std::uint32_t first_part = kParts<N> * static_cast<std::uint32_t>(which[n]);
    *found = first_part;
    if constexpr (kParts<N> == 1) {
      found -= lower | upper;
    } else {
      found -= lower;
      *found = first_part + 1;
      found -= upper;
    }
  }
  return found;
}

// whole: the falloff's power, as a compile-time constant if the caller passes one.
template <class N>
SEMBLANCE_INLINE double Sum(const Summands& all, const Vec3& p, int whole, std::int64_t& reaching) {
  constexpr std::size_t kAtOnce = 32;  // groups of eight balls per pass
  std::array<std::uint32_t, 2 * kHalf * kAtOnce + 1> found;
  std::array<N, kParts<N>> sums{};
  std::int64_t halves = 0;
  for (std::size_t begin = 0; begin < all.reaches.size(); begin += kAtOnce) {
    std::uint32_t* end = found.data();
    for (std::size_t n = begin; n < std::min(begin + kAtOnce, all.reaches.size()); ++n) {
      const auto rest = all.which.subspan(kHalf * n);
      const auto four = rest.first(std::min<std::size_t>(kHalf, rest.size()));
      end = AppendReaching<N>(four, all.reaches[n], p, halves, end);
    }
    for (const std::uint32_t* n = found.data(); n != end; ++n) {
      const unsigned part = *n % kParts<N>;
      sums[part] += Emit<N>(all.batches[*n / kParts<N>], kHalf * part, p, all.falloff, whole);
    }
  }
  reaching += kHalf * halves;
  DistanceEmitterLanes::Lanes s;
  std::memcpy(s.data(), sums.data(), sizeof s);
  return ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
}

template <class N>
SEMBLANCE_INLINE double Sum(const Summands& all, const Vec3& p, std::int64_t& reaching) {
  constexpr int kDefaultPower = 6;  // of the default decay; the constant lets the compiler unroll
                                    // the power
  return all.falloff.whole == kDefaultPower ? Sum<N>(all, p, kDefaultPower, reaching)
                                            : Sum<N>(all, p, all.falloff.whole, reaching);
}

SEMBLANCE_ONLY_512 double SumByEights(const Summands& all, const Vec3& p, std::int64_t& reaching) {
  return Sum<Wider>(all, p, reaching);
}
SEMBLANCE_WIDE_256 double SumByFours(const Summands& all, const Vec3& p, std::int64_t& reaching) {
  return Sum<Wide>(all, p, reaching);
}

// The corners of a lane's triangle at its place of emission.
std::array<Vec3, 3> LaneCorners(const DistanceEmitterLanes& batch, int l) {
  const auto at = [l](const std::array<DistanceEmitterLanes::Lanes, 3>& lanes) {
    return Vec3(lanes[0][l], lanes[1][l], lanes[2][l]);
  };
  const Vec3 a = at(batch.corner), x = at(batch.along), y = at(batch.across);
  return {a, a + batch.ab.length[l] * x,
          a + batch.ac.length[l] * (batch.ac.x[l] * x + batch.ac.y[l] * y)};
}

// The ball around four lanes, from `first` on.
ReachBall MakeReachBall(const DistanceEmitterLanes& batch, int first, const Falloff& falloff) {
  constexpr double kSlack = 1 + 1e-9;
  int end = first;  // end of the lanes that are set
  Box3 box;
  for (; end < first + kHalf && batch.gain[end] > 0; ++end) {
    for (const Vec3& corner : LaneCorners(batch, end)) {
      box.extend(corner);
    }
  }
  if (box.isEmpty()) {
    return {};
  }
  const Vec3 center = box.center();
  double radius_mm = 0;
  for (int l = first; l < end; ++l) {
    const double emitting_mm = std::pow(batch.gain[l] / falloff.cut, 1 / falloff.power);
    const double solid_mm = batch.advance_mm[l];
    for (const Vec3& corner : LaneCorners(batch, l)) {
      radius_mm = std::max(radius_mm, (corner - center).norm() + std::max(emitting_mm, solid_mm));
    }
  }
  return {center, kSlack * radius_mm * radius_mm};
}

}  // namespace

void DistanceEmitterLanes::Set(int lane, const Vec3& a, const Vec3& b, const Vec3& c,
                               const Vec3& unit_normal, double advance, double floor,
                               double lane_gain) {
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

double DistanceKernel::AtDistance(const EmitterTriangle& t, double distance) const {
  const double floored2 = std::max(distance * distance, t.Floor2(1 - split_));
  const double emission = t.gain * falloff_.InversePower(floored2);
  return emission < falloff_.cut ? 0 : std::min(emission, kMaxEmission);
}

std::vector<DistanceEmitterLanes> DistanceKernel::MakeLanes(
    std::span<const EmitterTriangle> emitters) const {
  constexpr std::size_t kLanes = DistanceEmitterLanes::kLanes;
  std::vector<DistanceEmitterLanes> lanes((emitters.size() + kLanes - 1) / kLanes);
  for (std::size_t e = 0; e < emitters.size(); ++e) {
    const EmitterTriangle& t = emitters[e];
    lanes[e / kLanes].Set(static_cast<int>(e % kLanes), t.a, t.b, t.c, t.normal, Advance(t),
                          Floor(t), t.gain);
  }
  return lanes;
}

std::vector<ReachBall> MakeReachBalls(std::span<const DistanceEmitterLanes> batches,
                                      const Falloff& falloff) {
  std::vector<ReachBall> reaches;
  reaches.reserve(2 * batches.size());
  for (const DistanceEmitterLanes& batch : batches) {
    reaches.push_back(MakeReachBall(batch, 0, falloff));
    reaches.push_back(MakeReachBall(batch, kHalf, falloff));
  }
  return reaches;
}

std::vector<ReachLanes> Gather(std::span<const ReachBall> reaches,
                               std::span<const std::int32_t> which) {
  constexpr std::size_t kLanes = DistanceEmitterLanes::kLanes;
  std::vector<ReachLanes> eights((2 * which.size() + kLanes - 1) / kLanes);
  for (std::size_t n = 0; n < 2 * which.size(); ++n) {
    const ReachBall& reach = reaches[2 * which[n / 2] + n % 2];
    ReachLanes& eight = eights[n / kLanes];
    for (int axis = 0; axis < 3; ++axis) {
      eight.center[axis][n % kLanes] = reach.center[axis];
    }
    eight.squared_mm2[n % kLanes] = reach.squared_mm2;
  }
  return eights;
}

double SumByDistance(std::span<const DistanceEmitterLanes> batches,
                     std::span<const std::int32_t> which, std::span<const ReachLanes> reaches,
                     const Vec3& p, const Falloff& falloff, std::int64_t& reaching) {
  const Summands summands{batches, which, reaches, falloff};
  return HasAvx512() ? SumByEights(summands, p, reaching) : SumByFours(summands, p, reaching);
}

double EmitByDistance(const DistanceEmitterLanes& batch, int lane, const Vec3& p,
                      const Falloff& falloff) {
  return Emit<double>(batch, lane, p, falloff, falloff.whole);
}

}  // namespace semblance::surfaces
