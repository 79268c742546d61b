// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/closed_mesh/sphere_relaxer.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace semblance {
namespace {

// With both curvatures positive, so that Newton's direction goes down.
Eigen::Matrix2d MadePositive(Eigen::Matrix2d curvature) {
  constexpr double kLeast = 1e-3;  // of the larger
  const double middle = curvature.trace() / 2,
               apart = std::sqrt(std::max(middle * middle - curvature.determinant(), 0.0)),
               least = middle - apart,
               floor = kLeast * std::max(std::abs(middle + apart), std::abs(least));
  curvature.diagonal().array() += std::max(floor - least, 0.0);
  return curvature;
}

}  // namespace

void SphereRelaxer::Gather(std::int32_t vertex) {
  const Ring& ring = rings_[vertex];
  around_.clear();
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const std::int32_t b = ring[k], c = ring[k + 1 < ring.size() ? k + 1 : 0];
    around_.emplace_back(
        InSpace(scale_ * (points_[b] - points_[vertex]), scale_ * (points_[c] - points_[vertex])),
        at_[b], at_[c]);
  }
}

double SphereRelaxer::EnergyAt(const Vec3& place) const {
  double energy = 0;
  for (const TriangleOnSphere& triangle : around_) {
    energy += triangle.Energy(place);
  }
  return energy;
}

// In the plane that touches the sphere; along the sphere the energy curves by its slope outwards
// less.
Vec3 SphereRelaxer::NewtonStep(const Vec3& from) const {
  Vec3 gradient = Vec3::Zero();
  Mat3 hessian = Mat3::Zero();
  for (const TriangleOnSphere& triangle : around_) {
    triangle.AddDerivatives(from, gradient, hessian);
  }
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = from.unitOrthogonal();
  across.col(1) = from.cross(across.col(0));
  Eigen::Matrix2d curvature = across.transpose() * hessian * across;
  curvature.diagonal().array() -= gradient.dot(from);
  const Vec2 slope = across.transpose() * gradient;
  return -across * (MadePositive(curvature).inverse() * slope);
}

bool SphereRelaxer::TakeIfBetter(const Vec3& place, std::int32_t vertex, double& least) const {
  const double energy = EnergyAt(place);
  if (!(energy < least)) {
    return false;
  }
  least = energy;
  at_[vertex] = place;
  return true;
}

void SphereRelaxer::Move(std::int32_t vertex) {
  constexpr int kHalvings = 9;
  Gather(vertex);
  const Vec3 from = at_[vertex], step = NewtonStep(from);
  double least = EnergyAt(from);
  for (int k = 0; k <= kHalvings; ++k) {
    if (TakeIfBetter((from + std::ldexp(1.0, -k) * step).normalized(), vertex, least)) {
      return;
    }
  }
}

// Towards the middle of the ring; where that turns a triangle, next to the first of the ring, whose
// triangles cover it all, and half-way between the two edges there.
void SphereRelaxer::Place(const Removal& removal) {
  constexpr int kHalvings = 50;
  const auto& [vertex, ring] = removal;
  Gather(vertex);
  const Vec3 hub = at_[ring.front()];
  at_[vertex] = hub;
  Vec3 middle = Vec3::Zero();
  for (const std::int32_t n : ring) {
    middle += at_[n] / static_cast<double>(ring.size());
  }
  double least = std::numeric_limits<double>::infinity();
  for (const double share : {1.0, 0.5, 0.25}) {
    TakeIfBetter((hub + share * (middle - hub)).normalized(), vertex, least);
  }
  const Vec3 inwards =
      hub.cross(at_[ring[1]]).normalized() + at_[ring.back()].cross(hub).normalized();
  const double edge = (at_[ring[1]] - hub).norm();
  for (int k = 1; k <= kHalvings && !std::isfinite(least); ++k) {
    TakeIfBetter((hub + std::ldexp(edge, -k) * inwards).normalized(), vertex, least);
  }
}

}  // namespace semblance
