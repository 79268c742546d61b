// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/emitter_reach.h"

#include <limits>

#include "surfaces/emitters/simd.h"

namespace semblance {
namespace {

// Squared distance along one axis between [low, high] and all within `half` of the center.
SEMBLANCE_INLINE Wide SquaredGap(const Wide& low, const Wide& high, double center, double half) {
  const Wide gap = Greater(Greater(low - center, center - high) - half, Wide{});
  return gap * gap;
}

SEMBLANCE_INLINE Wide MostOf(const EmitterReach& b, int first, const Vec3& center, const Vec3& half,
                             const ReachFall& fall) {
  Wide height = -Load<Wide>(b.offset_mm, first), slack = Magnitude(height), from2{}, way2{};
  for (int axis = 0; axis < 3; ++axis) {
    const double at = center[axis], reach = half[axis];
    const Wide normal = Load<Wide>(b.normal[axis], first), low = Load<Wide>(b.low[axis], first),
               high = Load<Wide>(b.high[axis], first), moved = Load<Wide>(b.moved[axis], first);
    height += normal * at + Magnitude(normal) * reach;
    slack += std::abs(at) + reach;
    from2 += SquaredGap(low, high, at, reach);
    way2 += SquaredGap(Smaller(low, low - moved), Greater(high, high - moved), at, reach);
  }
  height += kRounding * slack;
  Wide most = Load<Wide>(b.gain, first) * InversePowerOf(from2, fall.power, fall.whole);
  if (fall.by_height) {
    most *= Smaller(height, SquareRoot(from2));
  }
  most = most < All<Wide>((1 - kRounding) * fall.cut) ? Wide{} : most;
  most = way2 > 0 ? most : All<Wide>(std::numeric_limits<double>::infinity());
  return height > 0 ? most : Wide{};
}

}  // namespace

void EmitterReach::Set(int lane, const EmitterTriangle& t) {
  const Vec3 least = t.a.cwiseMin(t.b).cwiseMin(t.c) + t.moved,
             most = t.a.cwiseMax(t.b).cwiseMax(t.c) + t.moved;
  for (int k = 0; k < 3; ++k) {
    low[k][lane] = least[k];
    high[k][lane] = most[k];
    moved[k][lane] = t.moved[k];
    normal[k][lane] = t.normal[k];
  }
  offset_mm[lane] = t.a.dot(t.normal);
  gain[lane] = (1 + kRounding) * t.most_gain;
}

SEMBLANCE_WIDE void MostInBox(const EmitterReach& batch, const Vec3& center, const Vec3& half,
                              const ReachFall& fall, EmitterReach::Lanes& most) {
  for (int first = 0; first < EmitterReach::kLanes; first += kWidth<Wide>) {
    Store(MostOf(batch, first, center, half, fall), most, first);
  }
}

}  // namespace semblance
