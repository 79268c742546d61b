// SPDX-License-Identifier: GPL-3.0-or-later
// The points of a mesh that is being decimated, each of which belongs to a triangle of what is
// left.
#pragma once

#include <cstdint>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Keeps a reference to the mesh given, whose triangles' numbers those that are left keep.
class GivenPoints {
 public:
  explicit GivenPoints(const TriMesh& mesh);

  // Of a triangle.
  void Append(std::int32_t triangle, std::vector<std::int32_t>& points) const;
  void Clear(std::int32_t triangle) { first_[triangle] = -1; }
  void Give(std::int32_t triangle, std::int32_t point, double distance_mm);

  // The largest that was given of those that points have now.
  double LargestDistance_mm() const;

  // p is no further than this from the mesh given: as far as from the triangles at the nearest of
  // some of its points. Infinite if there are none.
  double DistanceBound_mm(const Vec3& p, const std::vector<std::int32_t>& points) const;

 private:
  const TriMesh& mesh_;
  std::vector<std::int32_t> first_, next_;  // lists, one a triangle; -1: none
  std::vector<double> distance_mm_;         // of each point
  std::vector<std::int32_t> corner_of_;  // triangles at point v: up to last_[v] from the one before
  std::vector<std::int32_t> last_;
};

}  // namespace semblance
