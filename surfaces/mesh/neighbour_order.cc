// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/neighbour_order.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <utility>

namespace semblance::surfaces {
namespace {

// The triangles at each vertex v: those of `around` from first[v] to first[v + 1].
struct TrianglesAtVertices {
  std::vector<std::int32_t> first, around;

  explicit TrianglesAtVertices(const TriMesh& mesh)
      : first(mesh.points.size() + 2, 0), around(3 * mesh.triangles.size()) {
    for (const Triangle& t : mesh.triangles) {
      for (const std::int32_t v : t) {
        ++first[v + 2];
      }
    }
    std::partial_sum(first.begin(), first.end(), first.begin());
    for (std::int32_t t = 0; t < std::ssize(mesh.triangles); ++t) {
      for (const std::int32_t v : mesh.triangles[t]) {
        around[first[v + 1]++] = t;
      }
    }
  }
};

}  // namespace

bool IsScattered(const TriMesh& mesh) {
  // Rows of a square surface. Not sensitive: stored row by row it has 1, in random order about a
  // third of all rows.
  constexpr double kRows = 8;
  double apart = 0;
  for (const Triangle& t : mesh.triangles) {
    apart += std::abs(t[0] - t[1]);
  }
  return apart > kRows * std::sqrt(double(mesh.points.size())) * double(mesh.triangles.size());
}

OrderedMesh InOrderOfNeighbours(const TriMesh& mesh) {
  const TrianglesAtVertices at(mesh);
  OrderedMesh ordered;
  std::vector<std::int32_t> index(mesh.points.size(), -1);
  std::vector<bool> taken(mesh.triangles.size(), false);
  const auto meet = [&](std::int32_t v) {
    if (index[v] < 0) {
      index[v] = static_cast<std::int32_t>(ordered.vertices.size());
      ordered.vertices.push_back(v);
      ordered.mesh.points.push_back(mesh.points[v]);
    }
  };
  std::size_t next = 0;
  for (std::int32_t start = 0; start < std::ssize(mesh.points); ++start) {
    meet(start);
    for (; next < ordered.vertices.size(); ++next) {
      const std::int32_t v = ordered.vertices[next];
      for (std::int32_t n = at.first[v]; n < at.first[v + 1]; ++n) {
        const std::int32_t t = at.around[n];
        if (!taken[t]) {
          taken[t] = true;
          std::ranges::for_each(mesh.triangles[t], meet);
          ordered.triangles.push_back(t);
        }
      }
    }
  }
  for (const std::int32_t t : ordered.triangles) {
    const Triangle& c = mesh.triangles[t];
    ordered.mesh.triangles.push_back({index[c[0]], index[c[1]], index[c[2]]});
  }
  return ordered;
}

void PutBackInOrder(const OrderedMesh& ordered, const std::vector<std::int32_t>& triangles,
                    TriMesh& part) {
  std::vector<Vec3> points(part.points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    points[ordered.vertices[v]] = part.points[v];
  }
  std::vector<std::pair<std::int32_t, Triangle>> sorted;
  for (std::size_t n = 0; n < triangles.size(); ++n) {
    const Triangle& t = part.triangles[n];
    sorted.push_back({ordered.triangles[triangles[n]],
                      {ordered.vertices[t[0]], ordered.vertices[t[1]], ordered.vertices[t[2]]}});
  }
  std::ranges::sort(sorted);
  part.points = std::move(points);
  std::ranges::transform(sorted, part.triangles.begin(),
                         [](const auto& placed) { return placed.second; });
}

}  // namespace semblance::surfaces
