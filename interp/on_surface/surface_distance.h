// SPDX-License-Identifier: GPL-3.0-or-later
// Geodesic distances along the skull's surface.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "interp/dowels/dowel_samples.h"
#include "interp/on_surface/coarse_surface.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::interp {

enum class DowelDistance { kEuclidean, kGeodesic };
constexpr auto EnumNames(DowelDistance) {
  return std::to_array<std::string_view>({"euclidean", "geodesic"});
}

// The common option of all schemes with a choice of distance.
template <class Visitor>
void DistanceField(Visitor& visit, DowelDistance& distance) {
  visit(FieldInfo{.name = "distance",
                  .doc = "distance between dowels and vertices: euclidean (straight), or geodesic "
                         "(along the bone), so that a dowel has no effect through the bone or "
                         "across a gap; pieces of the skull without a dowel then get no depth; "
                         "some 0.3 s per dowel on a skull of 400k vertices"},
        distance);
}

// Fast marching with waves that are spherical within each triangle. It is exact on a plane if the
// path passes between the two corners from which it comes; otherwise it errs by some tenths of an
// edge near the source and by up to 2 % far away. It accepts any triangles: open, in several
// pieces, non-manifold, slivers.
class SurfaceDistance {
 public:
  // Throws InputError as MeshQuery does. The mesh must outlive this object.
  explicit SurfaceDistance(const TriMesh& mesh);

  // The distance, in mm, from the surface's point closest to p to each vertex; infinite on other
  // pieces.
  std::vector<double> From(const Vec3& p) const;

 private:
  const TriMesh& mesh_;
  MeshQuery query_;
  VertexTriangles triangles_at_;
};

// Calls use(k, distances of sample k) in order, from one thread. The distances are computed on
// run.threads threads, a few samples at a time. Throws InputError, with the scheme's name, if the
// skull has no triangle; Cancelled if stopped.
void ForEachGeodesic(std::string_view scheme, const TriMesh& skull,
                     const std::vector<DepthSample>& samples, const RunContext& run,
                     const std::function<void(std::size_t, const std::vector<double>&)>& use);

}  // namespace semblance::interp
