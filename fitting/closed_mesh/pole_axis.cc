// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/closed_mesh/pole_axis.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "fitting/closed_mesh/triangle_on_sphere.h"

namespace semblance {
namespace {

// Of one triangle.
struct Distortion {
  Vec3 middle;    // on the sphere
  double area;    // in space
  double energy;  // over it; twice the area where nothing is distorted
};

std::vector<Distortion> DistortionsOf(const TriMesh& mesh, std::span<const Vec3> at) {
  const double scale = std::sqrt(4 * std::numbers::pi / Area(mesh));
  std::vector<Distortion> distortions;
  distortions.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    const auto& [i, j, k] = t;
    const TriangleInSpace shape = InSpace(scale * (mesh.points[j] - mesh.points[i]),
                                          scale * (mesh.points[k] - mesh.points[i]));
    const TriangleOnSphere triangle(shape, at[j], at[k]);
    distortions.push_back({.middle = (at[i] + at[j] + at[k]).normalized(),
                           .area = shape.twice_area / 2,
                           .energy = triangle.Energy(at[i])});
  }
  return distortions;
}

// Mean about the worse of the two ends.
double WorseEnd(const Vec3& axis, const std::vector<Distortion>& distortions) {
  const double kReach = std::cos(std::numbers::pi / 12);
  std::array<double, 2> areas = {0, 0}, energies = {0, 0};
  for (const Distortion& d : distortions) {
    const double along = d.middle.dot(axis);
    if (std::abs(along) > kReach) {
      areas[along > 0] += d.area;
      energies[along > 0] += d.energy;
    }
  }
  return std::max(energies[0] / areas[0], energies[1] / areas[1]);
}

}  // namespace

Vec3 LeastDistortedAxis(const TriMesh& mesh, std::span<const Vec3> at) {
  constexpr int kTried = 200;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));  // of a spiral that covers evenly
  const std::vector<Distortion> distortions = DistortionsOf(mesh, at);
  Vec3 best = Vec3::UnitZ();
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kTried; ++k) {
    const double z = (k + 0.5) / kTried, across = std::sqrt(1 - z * z);
    const Vec3 axis(across * std::cos(golden * k), across * std::sin(golden * k), z);
    if (const double worse = WorseEnd(axis, distortions); worse < least) {
      least = worse;
      best = axis;
    }
  }
  return best;
}

}  // namespace semblance
