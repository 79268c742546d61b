// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/decimate/original_vertices.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "surfaces/mesh/point_triangle.h"

namespace semblance {

OriginalVertices::OriginalVertices(const TriMesh& mesh)
    : mesh_(mesh),
      first_(mesh.triangles.size(), -1),
      next_(mesh.points.size(), -1),
      distance_mm_(mesh.points.size(), 0),
      corner_of_(3 * mesh.triangles.size()),
      last_(mesh.points.size() + 1, 0) {
  for (const Triangle& t : mesh.triangles) {
    for (const std::int32_t v : t) {
      ++last_[v + 1];
    }
  }
  std::partial_sum(last_.begin(), last_.end(), last_.begin());
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(mesh.triangles.size()); ++t) {
    for (const std::int32_t v : mesh.triangles[t]) {
      corner_of_[last_[v]++] = t;
    }
  }
  for (std::int32_t v = 0; v < static_cast<std::int32_t>(mesh.points.size()); ++v) {
    if (last_[v] > (v > 0 ? last_[v - 1] : 0)) {
      Assign(corner_of_[last_[v] - 1], v, 0);
    }
  }
}

void OriginalVertices::AppendOf(std::int32_t triangle, std::vector<std::int32_t>& vertices) const {
  for (std::int32_t v = first_[triangle]; v >= 0; v = next_[v]) {
    vertices.push_back(v);
  }
}

void OriginalVertices::Assign(std::int32_t triangle, std::int32_t vertex, double distance_mm) {
  next_[vertex] = first_[triangle];
  first_[triangle] = vertex;
  distance_mm_[vertex] = distance_mm;
}

double OriginalVertices::LargestDistance_mm() const {
  return *std::max_element(distance_mm_.begin(), distance_mm_.end());
}

double OriginalVertices::DistanceBound_mm(const Vec3& p,
                                          const std::vector<std::int32_t>& vertices) const {
  double least = std::numeric_limits<double>::infinity();
  std::int32_t nearest = -1;
  for (const std::int32_t v : vertices) {
    const double distance2 = (mesh_.points[v] - p).squaredNorm();
    if (distance2 < least) {
      least = distance2;
      nearest = v;
    }
  }
  for (std::int32_t n = nearest > 0 ? last_[nearest - 1] : 0; nearest >= 0 && n < last_[nearest];
       ++n) {
    const Triangle& t = mesh_.triangles[corner_of_[n]];
    const Vec3 there =
        ClosestPointOnTriangle(p, mesh_.points[t[0]], mesh_.points[t[1]], mesh_.points[t[2]])
            .position;
    least = std::min(least, (there - p).squaredNorm());
  }
  return std::sqrt(least);
}

}  // namespace semblance
