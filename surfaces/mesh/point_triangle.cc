// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/point_triangle.h"

#include <algorithm>

namespace semblance {
namespace {

// Below this share of |ab|^2 |ac|^2 the squared sine at a is rounding, and the edges say all.
constexpr double kFlat = 1e-14;

// The weights of the foot of p on the triangle's plane; one is negative if it lies outside.
Vec3 FootWeights(const Vec3& p, const Vec3& a, const Vec3& ab, const Vec3& ac) {
  const Vec3 ap = p - a;
  const double bb = ab.squaredNorm(), cc = ac.squaredNorm(), bc = ab.dot(ac);
  const double det = bb * cc - bc * bc;
  if (!(det > kFlat * bb * cc)) {
    return Vec3::Constant(-1);
  }
  const double v = (cc * ap.dot(ab) - bc * ap.dot(ac)) / det;
  const double w = (bb * ap.dot(ac) - bc * ap.dot(ab)) / det;
  return {1 - v - w, v, w};
}

double ClampedShare(const Vec3& p, const Vec3& from, const Vec3& to) {
  const double length2 = (to - from).squaredNorm();
  return length2 > 0 ? std::clamp((p - from).dot(to - from) / length2, 0.0, 1.0) : 0;
}

}  // namespace

TrianglePoint ClosestPointOnTriangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 foot = FootWeights(p, a, b - a, c - a);
  if (foot.minCoeff() >= 0) {
    return {foot[0] * a + foot[1] * b + foot[2] * c, foot};
  }
  const Vec3* corners[] = {&a, &b, &c};
  TrianglePoint best;
  double best_distance2 = std::numeric_limits<double>::infinity();
  for (int from = 0; from < 3; ++from) {
    const int to = (from + 1) % 3;
    const double share = ClampedShare(p, *corners[from], *corners[to]);
    const Vec3 position = *corners[from] + share * (*corners[to] - *corners[from]);
    const double distance2 = (p - position).squaredNorm();
    if (distance2 < best_distance2) {
      best_distance2 = distance2;
      best = {position, Vec3::Zero()};
      best.weights[from] = 1 - share;
      best.weights[to] = share;
    }
  }
  return best;
}

}  // namespace semblance
