// SPDX-License-Identifier: GPL-3.0-or-later
// A closed mesh on the unit sphere, whose vertices move so that triangles keep their shapes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fitting/closed_mesh/closed_rings.h"
#include "fitting/closed_mesh/triangle_on_sphere.h"
#include "surfaces/base/geometry.h"

namespace semblance {

// Lowers the sum of the triangles' symmetric Dirichlet energies (Schreiner et al. 2004, Smith &
// Schaefer 2015). It punishes what is stretched and what is squeezed alike, and is infinite for a
// triangle without area, so that none ever turns over.
class SphereRelaxer {
 public:
  // Keeps references. scale: of lengths in space, so that areas there are as large as here.
  SphereRelaxer(std::span<const Vec3> points, const std::vector<Ring>& rings, double scale,
                std::vector<Vec3>& at)
      : points_(points), rings_(rings), scale_(scale), at_(at) {}

  // Finds a place for a vertex that has been put back, from which no triangle is turned.
  void Place(const Removal& removal);

  // A step of Newton's method, halved until the energy is less.
  void Move(std::int32_t vertex);

 private:
  void Gather(std::int32_t vertex);
  double EnergyAt(const Vec3& place) const;
  Vec3 NewtonStep(const Vec3& from) const;
  bool TakeIfBetter(const Vec3& place, std::int32_t vertex, double& least) const;

  std::span<const Vec3> points_;
  const std::vector<Ring>& rings_;
  double scale_;
  std::vector<Vec3>& at_;
  std::vector<TriangleOnSphere> around_;  // the vertex that is looked at
};

}  // namespace semblance
