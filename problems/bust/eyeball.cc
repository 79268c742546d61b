// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/bust/eyeball.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace semblance {
namespace {

constexpr int kRound = 64;  // points of a ring
constexpr double kPupil_mm = 1.9, kIris_mm = 5.4, kLimbus_mm = 5.9;
constexpr double kCornea_mm = 0.5;                // that it rises over the sphere
constexpr double kBack = 0.6 * std::numbers::pi;  // angle from the gaze where the shell ends

class EyeShell {
 public:
  EyeShell(const Sphere& ball, const Vec3& gaze, const Vec3& up) : ball_(ball), gaze_(gaze) {
    right_ = gaze.cross(up).normalized();
    up_ = right_.cross(gaze);
  }

  // From one angle off the gaze to another.
  TriMesh Ring(double from, double to, int steps) const {
    TriMesh mesh;
    for (int s = 0; s <= steps; ++s) {
      for (int k = 0; k < kRound; ++k) {
        mesh.points.push_back(
            At(from + (to - from) * s / steps, 2 * std::numbers::pi * k / kRound));
      }
    }
    for (int s = 0; s < steps; ++s) {
      for (int k = 0; k < kRound; ++k) {
        const int a = s * kRound + k, b = s * kRound + (k + 1) % kRound;
        if (from > 0 || s > 0) {
          mesh.triangles.push_back({a, b, a + kRound});
        }
        mesh.triangles.push_back({b, b + kRound, a + kRound});
      }
    }
    return mesh;
  }

 private:
  Vec3 At(double angle, double round) const {
    const double end = 1.15 * std::asin(std::min(kLimbus_mm / ball_.radius_mm, 0.8));
    const double t = std::max(0.0, 1 - angle * angle / (end * end));
    const double radius = ball_.radius_mm + kCornea_mm * t * t;
    const Vec3 side = std::cos(round) * right_ + std::sin(round) * up_;
    return ball_.center + radius * (std::cos(angle) * gaze_ + std::sin(angle) * side);
  }

  Sphere ball_;
  Vec3 gaze_, right_, up_;
};

}  // namespace

std::vector<EyePart> EyeParts(const Sphere& ball, const Vec3& gaze, const Vec3& up) {
  const EyeShell shell(ball, gaze, up);
  const auto angle = [&](double radius_mm) {
    return std::asin(std::min(radius_mm / ball.radius_mm, 0.9));
  };
  const double pupil = angle(kPupil_mm), iris = angle(kIris_mm), limbus = angle(kLimbus_mm);
  return {{"sclera", {0.93, 0.91, 0.89}, shell.Ring(limbus, kBack, 16)},
          {"limbus", {0.20, 0.19, 0.19}, shell.Ring(iris, limbus, 2)},
          {"iris", {0.39, 0.36, 0.31}, shell.Ring(pupil, iris, 6)},
          {"pupil", {0.03, 0.03, 0.03}, shell.Ring(0, pupil, 3)}};
}

Sphere SphereThrough(std::span<const Vec3> points) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : points) {
    middle += p / static_cast<double>(n);
  }
  Eigen::MatrixXd left(n, 4);
  Eigen::VectorXd right(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vec3 p = points[i] - middle;
    left.row(i) << 2 * p.transpose(), 1;
    right[i] = p.squaredNorm();
  }
  const Eigen::Vector4d x = left.colPivHouseholderQr().solve(right);
  return {middle + x.head<3>(), std::sqrt(x[3] + x.head<3>().squaredNorm())};
}

}  // namespace semblance
