// SPDX-License-Identifier: GPL-3.0-or-later
// Distances along the skull's surface.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "interp/dowels/dowel_samples.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {

enum class DowelDistance { kEuclidean, kGeodesic };
constexpr auto EnumNames(DowelDistance) {
  return std::to_array<std::string_view>({"euclidean", "geodesic"});
}

// The option behind it: alike for all schemes that have it.
template <class Visitor>
void DistanceField(Visitor& visit, DowelDistance& distance) {
  visit(FieldInfo{.name = "distance",
                  .doc = "between dowels and vertices: euclidean, a straight line, or geodesic, "
                         "along the bone, by which a dowel does not reach through it or across a "
                         "gap; pieces of the skull that are closest to no dowel get no depth then; "
                         "some 0.3 s per dowel on a skull of 400k vertices"},
        distance);
}

// Fast marching with waves that are spherical in each triangle: exact on a plane where the
// way passes between the two corners it comes from; else off by some tenths of an edge near the
// source and by up to 2 % far away. Takes any triangles: open, of several pieces, non-manifold,
// slivers.
class SurfaceDistance {
 public:
  // Throws InputError as MeshQuery. The mesh must outlive this.
  explicit SurfaceDistance(const TriMesh& mesh);

  // mm, from the point of the surface closest to p, one per vertex; infinite on other pieces.
  std::vector<double> From(const Vec3& p) const;

 private:
  std::span<const int> TrianglesAt(int vertex) const {
    return {triangles_at_.data() + first_at_[vertex],
            static_cast<std::size_t>(first_at_[vertex + 1] - first_at_[vertex])};
  }

  const TriMesh& mesh_;
  MeshQuery query_;
  std::vector<int> first_at_, triangles_at_;  // the triangles of each vertex
};

// use(k, distances of sample k), in order, from one thread; the distances are found on run.threads
// threads, a few samples at a time. Throws InputError, naming the scheme, if the skull has no
// triangle; Cancelled if stopped.
void ForEachGeodesic(std::string_view scheme, const TriMesh& skull,
                     const std::vector<DepthSample>& samples, const RunContext& run,
                     const std::function<void(std::size_t, const std::vector<double>&)>& use);

}  // namespace semblance
