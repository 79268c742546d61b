// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/mesh_query.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <fmt/format.h>

#include <algorithm>

#include "surfaces/base/error.h"
#include "surfaces/mesh/point_triangle.h"

namespace semblance {
namespace {

using QueryKernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<QueryKernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<QueryKernel, Triangles::const_iterator>;
using Traits = CGAL::AABB_traits<QueryKernel, Primitive>;

QueryKernel::Point_3 ToCgal(const Vec3& p) { return {p.x(), p.y(), p.z()}; }
Vec3 ToVec(const QueryKernel::Point_3& p) { return {p.x(), p.y(), p.z()}; }

Triangles CopyTriangles(const TriMesh& mesh) {
  if (mesh.triangles.empty()) {
    throw InputError("mesh query: the mesh has no triangles; give one with at least one");
  }
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (!mesh.points[i].allFinite()) {
      throw InputError(fmt::format("mesh query: point {} is not finite; repair the mesh first", i));
    }
  }
  Triangles triangles;
  triangles.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    triangles.emplace_back(ToCgal(mesh.points[t[0]]), ToCgal(mesh.points[t[1]]),
                           ToCgal(mesh.points[t[2]]));
  }
  return triangles;
}

}  // namespace

struct MeshQuery::Tree {
  // No ray meets a triangle without area: CGAL asks for triangles that have one, and the triangles
  // beside it are met. Closest points lie on it as on any other.
  struct RayTraits : Traits {
    struct Intersection {
      using Hit = Traits::Intersection_and_primitive_id<QueryKernel::Segment_3>::Type;
      boost::optional<Hit> operator()(const QueryKernel::Segment_3& ray,
                                      const Primitive& triangle) const {
        if (triangle.datum().is_degenerate()) return boost::none;
        return traits.Traits::intersection_object()(ray, triangle);
      }
      const RayTraits& traits;
    };
    Intersection intersection_object() const { return {*this}; }
  };

  explicit Tree(const TriMesh& mesh)
      : triangles(CopyTriangles(mesh)), tree(triangles.cbegin(), triangles.cend()) {
    tree.build();
    tree.accelerate_distance_queries();  // here, so that const queries from several threads never
                                         // build it
  }
  MeshPoint PointAt(const Vec3& position, const Triangles::const_iterator& triangle,
                    const Vec3& from) const {
    const Vec3 weights =
        ClosestPointOnTriangle(position, ToVec(triangle->vertex(0)), ToVec(triangle->vertex(1)),
                               ToVec(triangle->vertex(2)))
            .weights;
    return {position, static_cast<int>(triangle - triangles.cbegin()), (position - from).norm(),
            weights};
  }

  Triangles triangles;
  CGAL::AABB_tree<RayTraits> tree;
};

MeshQuery::MeshQuery(const TriMesh& mesh) : tree_(std::make_unique<Tree>(mesh)) {}
MeshQuery::~MeshQuery() = default;
MeshQuery::MeshQuery(MeshQuery&&) noexcept = default;
MeshQuery& MeshQuery::operator=(MeshQuery&&) noexcept = default;

MeshPoint MeshQuery::Closest(const Vec3& p) const {
  const auto found = tree_->tree.closest_point_and_primitive(ToCgal(p));
  return tree_->PointAt(ToVec(found.first), found.second, p);
}

std::vector<MeshPoint> MeshQuery::AllHits(const Vec3& origin, const Vec3& direction,
                                          double max_distance_mm) const {
  const Vec3 end = origin + max_distance_mm * direction.normalized();
  const QueryKernel::Segment_3 segment(ToCgal(origin), ToCgal(end));
  if (segment.is_degenerate()) return {};
  std::vector<Tree::RayTraits::Intersection::Hit> found;
  tree_->tree.all_intersections(segment, std::back_inserter(found));
  std::vector<MeshPoint> hits;
  for (const auto& hit : found) {
    // A ray that runs inside a triangle's plane meets it in a segment: its neighbours, met in
    // points, stand for it.
    if (const QueryKernel::Point_3* point = boost::get<QueryKernel::Point_3>(&hit.first)) {
      hits.push_back(tree_->PointAt(ToVec(*point), hit.second, origin));
    }
  }
  std::sort(hits.begin(), hits.end(), [](const MeshPoint& a, const MeshPoint& b) {
    return std::pair(a.distance_mm, a.triangle) < std::pair(b.distance_mm, b.triangle);
  });
  return hits;
}

std::optional<MeshPoint> MeshQuery::FirstHit(const Vec3& origin, const Vec3& direction,
                                             double max_distance_mm) const {
  const std::vector<MeshPoint> hits = AllHits(origin, direction, max_distance_mm);
  return hits.empty() ? std::nullopt : std::optional(hits.front());
}

}  // namespace semblance
