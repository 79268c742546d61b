// SPDX-License-Identifier: GPL-3.0-or-later
// The vectors and the few solids that every floor uses. All lengths in mm. World frame LPS: +x
// subject left, +y posterior, +z up.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>

namespace semblance {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Box3 = Eigen::AlignedBox3d;

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// p -> scale * rotation * p + translation. Named like `face_from_template`: face_from_template *
// p_in_template is in face.
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

}  // namespace semblance
