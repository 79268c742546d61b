// SPDX-License-Identifier: GPL-3.0-or-later
// Vectors, simple solids and formulas of geometry for all layers. All lengths are in mm. The world
// frame is LPS: +x points to the subject's left, +y backwards, +z up.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "surfaces/base/layers.h"

namespace semblance::surfaces {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Box3 = Eigen::AlignedBox3d;

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// The map p -> scale * rotation * p + translation. Variables are named after their frames:
// face_from_template * p_in_template is a point in the frame of the face.
struct Similarity {
  double scale = 1;                  // > 0
  Mat3 rotation = Mat3::Identity();  // proper rotation
  Vec3 translation = Vec3::Zero();   // mm

  Vec3 operator*(const Vec3& p) const { return scale * (rotation * p) + translation; }
};

struct Sphere {
  Vec3 center = Vec3::Constant(kNaN);
  double radius_mm = kNaN;  // > 0

  bool Contains(const Vec3& p) const { return (p - center).squaredNorm() <= radius_mm * radius_mm; }
};

// Returns 0 for x <= 0, 1 for x >= 1, and 3 x^2 - 2 x^3 between, with a continuous slope.
inline double SmoothStep(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// Distance from p to the segment ab, in mm, for Vec2 or Vec3. The ends may coincide.
template <class Vec>
double DistanceToSegment(const Vec& p, const Vec& a, const Vec& b) {
  const Vec ab = b - a;
  const double squared_length = ab.squaredNorm();
  const double t =
      squared_length > 0 ? std::clamp((p - a).dot(ab) / squared_length, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).norm();
}

// Returns the matrix M with M w = v x w.
inline Mat3 CrossMatrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace semblance::surfaces
