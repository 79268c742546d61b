// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/flat_batch.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "surfaces/wide.h"

namespace semblance {
namespace {

constexpr int kLanes = FlatBatch::kLanes;
constexpr double kTiny = 1e-300;  // mm^2
using Lanes = FlatBatch::Lanes;

// Squared longest edge over squared distance up to which 1, 4 and 16 parts do.
constexpr std::array<double, 3> kMostShare = {0.04, 0.12, 0.45};

// A part's centroid: that of the triangle + ab u + ac v.
struct Part {
  double u, v;
};

// The parts of a triangle cut into 4^level.
template <int level>
constexpr auto Parts() {
  constexpr int rows = 1 << level;
  std::array<Part, rows * rows> parts{};
  int count = 0;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; i + j < rows; ++j) {
      for (int third = 1; third <= 2 && i + j + third <= rows; ++third) {
        parts[count++] = {(i + third / 3.0) / rows - 1.0 / 3, (j + third / 3.0) / rows - 1.0 / 3};
      }
    }
  }
  return parts;
}

constexpr auto kOne = Parts<0>();
constexpr auto kFour = Parts<1>();
constexpr auto kSixteen = Parts<2>();

std::span<const Part> PartsOf(int level) {
  return level == 0   ? std::span<const Part>(kOne)
         : level == 1 ? std::span<const Part>(kFour)
                      : std::span<const Part>(kSixteen);
}

// Per lane: the vector from the centroid to p, the height, and the squared longest edge over the
// squared distance.
struct Seen {
  std::array<Lanes, 3> from{};
  Lanes height{}, share{};
};

SEMBLANCE_INLINE Seen See(const FlatBatch& batch, const Vec3& p) {
  const double x = p.x(), y = p.y(), z = p.z();
  Seen seen;
  for (int l = 0; l < kLanes; ++l) {
    const double dx = x - batch.at[0][l], dy = y - batch.at[1][l], dz = z - batch.at[2][l];
    seen.from[0][l] = dx;
    seen.from[1][l] = dy;
    seen.from[2][l] = dz;
    seen.height[l] = dx * batch.normal[0][l] + dy * batch.normal[1][l] + dz * batch.normal[2][l];
    seen.share[l] = batch.longest_mm2[l] / std::max(dx * dx + dy * dy + dz * dz, kTiny);
  }
  return seen;
}

// value <- value * square^exponent.
SEMBLANCE_INLINE void Raise(Lanes& value, Lanes& square, int exponent) {
  for (; exponent != 0; exponent >>= 1) {
    if ((exponent & 1) != 0) {
      for (int l = 0; l < kLanes; ++l) {
        value[l] *= square[l];
      }
    }
    for (int l = 0; l < kLanes; ++l) {
      square[l] *= square[l];
    }
  }
}

// Multiplies by the depth over its mean, to the power k: at the part's centroid, and how it changes
// from there with the integrand (tilt) and on its own (bow).
SEMBLANCE_INLINE void Weigh(const FlatBatch& batch, const Part& part, double smaller, int k,
                            const Lanes& tilt, Lanes& value, Lanes& bend) {
  Lanes share{}, weight{};
  for (int l = 0; l < kLanes; ++l) {
    share[l] = 1 + part.u * batch.rise_ab[l] + part.v * batch.rise_ac[l];
    weight[l] = 1;
    bend[l] += smaller * k * (tilt[l] / share[l] + 0.5 * (k - 1) * batch.bow[l]);
  }
  Raise(weight, share, k);
  for (int l = 0; l < kLanes; ++l) {
    value[l] *= weight[l];
  }
}

// Adds each triangle's integrand at one part's centroid, corrected by half the trace of its Hessian
// times the part's covariance, which is `smaller` times the triangle's.
SEMBLANCE_INLINE void AddPart(const FlatBatch& batch, const Seen& seen, const Part& part,
                              double smaller, int power, Lanes& sum) {
  Lanes value{}, square{}, bend{}, tilt{};
  for (int l = 0; l < kLanes; ++l) {
    const double dx = seen.from[0][l] - part.u * batch.ab[0][l] - part.v * batch.ac[0][l];
    const double dy = seen.from[1][l] - part.u * batch.ab[1][l] - part.v * batch.ac[1][l];
    const double dz = seen.from[2][l] - part.u * batch.ab[2][l] - part.v * batch.ac[2][l];
    const double along_ab = dx * batch.ab[0][l] + dy * batch.ab[1][l] + dz * batch.ab[2][l];
    const double along_ac = dx * batch.ac[0][l] + dy * batch.ac[1][l] + dz * batch.ac[2][l];
    const double along_bc = along_ac - along_ab;
    const double along2 = (along_ab * along_ab + along_ac * along_ac + along_bc * along_bc) / 36;
    const double inverse2 = 1 / std::max(dx * dx + dy * dy + dz * dz, kTiny);
    bend[l] = 1 + smaller * (0.5 * power * inverse2) *
                      ((power + 2) * along2 * inverse2 - batch.spread_mm2[l]);
    value[l] = inverse2;
    square[l] = inverse2;
    tilt[l] = power * inverse2 *
              (dx * batch.tilt_mm[0][l] + dy * batch.tilt_mm[1][l] + dz * batch.tilt_mm[2][l]);
  }
  if ((power & 1) != 0) {
    for (int l = 0; l < kLanes; ++l) {
      value[l] = std::sqrt(value[l]);
    }
    Raise(value, square, power >> 1);
  } else {
    Raise(value, square, (power >> 1) - 1);
  }
  if (batch.sloped) {
    Weigh(batch, part, smaller, power - 3, tilt, value, bend);
  }
  for (int l = 0; l < kLanes; ++l) {
    sum[l] += value[l] * bend[l];
  }
}

}  // namespace

void FlatBatch::Set(int lane, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& unit_normal,
                    double lane_gain) {
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

void FlatBatch::SetSlope(int lane, const Vec3& slope) {
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

SEMBLANCE_WIDE unsigned EmitFlat(const FlatBatch& batch, const Vec3& p, int power,
                                 FlatBatch::Lanes& emission) {
  const Seen seen = See(batch, p);
  double most = 0;
  unsigned near = 0;
  for (int l = 0; l < kLanes; ++l) {
    const bool emits = seen.height[l] > 0 && batch.gain[l] > 0;
    most = emits ? std::max(most, seen.share[l]) : most;
    near |= emits && seen.share[l] > kMostShare.back() ? 1U << l : 0U;
  }
  emission.fill(0);
  if (most == 0) {
    return 0;  // p is behind them all
  }
  const std::span<const Part> parts = PartsOf(most <= kMostShare[0]   ? 0
                                              : most <= kMostShare[1] ? 1
                                                                      : 2);
  const double smaller = 1.0 / static_cast<double>(parts.size());
  Lanes sum{};
  for (const Part& part : parts) {
    AddPart(batch, seen, part, smaller, power, sum);
  }
  for (int l = 0; l < kLanes; ++l) {
    const bool taken = seen.height[l] > 0 && (near >> l & 1U) == 0;
    emission[l] = taken ? batch.gain[l] * seen.height[l] * (sum[l] * smaller) : 0;
  }
  return near;
}

}  // namespace semblance
