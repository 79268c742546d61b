// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/decimate/patch_shape.h"

#include <algorithm>

namespace semblance {
namespace {

constexpr double kMostTurnCosine = 0.5;
constexpr double kLeastShape = 0.05;

// How near a triangle is to an equilateral one.
struct TriangleShape {
  Vec3 normal;   // not unit
  double sides;  // their squares' sum

  TriangleShape(const Vec3& a, const Vec3& b, const Vec3& c)
      : normal((b - a).cross(c - a)),
        sides((b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm()) {}
  // 1 if it is one, 0 without area; the square.
  double Squared() const { return sides > 0 ? 12 * normal.squaredNorm() / (sides * sides) : 0; }
  bool HasNormal() const { return normal.squaredNorm() > 1e-12 * sides * sides; }
};

bool TurnsFar(const Vec3& before, const Vec3& after) {
  const double dot = before.dot(after);
  return dot < 0 ||
         dot * dot < kMostTurnCosine * kMostTurnCosine * before.squaredNorm() * after.squaredNorm();
}

Vec3 AreaVectorBefore(const PatchPlaces& patch) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < patch.at_gone.size(); ++i) {
    const Vec3& apex = patch.ApexBefore(i);
    sum += 0.5 * (patch.ring[i] - apex).cross(patch.RingAfter(i) - apex);
  }
  return sum;
}

}  // namespace

Vec3 AreaVectorAfter(const PatchPlaces& patch) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < patch.at_gone.size(); ++i) {
    sum += 0.5 * (patch.ring[i] - patch.place).cross(patch.RingAfter(i) - patch.place);
  }
  return sum;
}

bool KeepsShape(const PatchPlaces& patch) {
  double least_before = 1, least_after = 1;
  for (const Vec3& p : patch.opposite) {
    least_before = std::min(least_before, TriangleShape(patch.keep, patch.gone, p).Squared());
  }
  for (std::size_t i = 0; i < patch.at_gone.size(); ++i) {
    const Vec3 &a = patch.ring[i], &b = patch.RingAfter(i);
    const TriangleShape before(patch.ApexBefore(i), a, b), after(patch.place, a, b);
    if (TurnsFar(before.HasNormal() ? before.normal : AreaVectorBefore(patch), after.normal)) {
      return false;
    }
    least_before = std::min(least_before, before.Squared());
    least_after = std::min(least_after, after.Squared());
  }
  return least_after >= kLeastShape * kLeastShape || least_after >= least_before;
}

}  // namespace semblance
