// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/mesh_query.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Kd_tree.h>
#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Simple_cartesian.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"

namespace semblance::surfaces {
namespace {

// Round-off: where the squared sine of the angle at a is smaller, the triangle counts as its edges.
constexpr double kFlat = 1e-14;

// The weights of the foot of p on the triangle's plane. One of them is negative if the foot lies
// outside the triangle.
Vec3 FootWeights(const Vec3& p, const Vec3& a, const Vec3& ab, const Vec3& ac) {
  const Vec3 ap = p - a;
  const double bb = ab.squaredNorm(), cc = ac.squaredNorm(), bc = ab.dot(ac);
  const double det = bb * cc - bc * bc;
  if (!(det > kFlat * bb * cc)) {
    return Vec3::Constant(-1);
  }
  const double v = (cc * ap.dot(ab) - bc * ap.dot(ac)) / det;
  const double w = (bb * ap.dot(ac) - bc * ap.dot(ab)) / det;
  return {1 - v - w, v, w};
}

double ClampedShare(const Vec3& p, const Vec3& from, const Vec3& to) {
  const double length2 = (to - from).squaredNorm();
  return length2 > 0 ? std::clamp((p - from).dot(to - from) / length2, 0.0, 1.0) : 0;
}

}  // namespace

TrianglePoint ClosestPointOnTriangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 foot = FootWeights(p, a, b - a, c - a);
  if (foot.minCoeff() >= 0) {
    return {foot[0] * a + foot[1] * b + foot[2] * c, foot};
  }
  const Vec3* corners[] = {&a, &b, &c};
  TrianglePoint best;
  double best_distance2 = std::numeric_limits<double>::infinity();
  for (int from = 0; from < 3; ++from) {
    const int to = (from + 1) % 3;
    const double share = ClampedShare(p, *corners[from], *corners[to]);
    const Vec3 position = *corners[from] + share * (*corners[to] - *corners[from]);
    const double distance2 = (p - position).squaredNorm();
    if (distance2 < best_distance2) {
      best_distance2 = distance2;
      best = {position, Vec3::Zero()};
      best.weights[from] = 1 - share;
      best.weights[to] = share;
    }
  }
  return best;
}

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

// The largest number of triangles whose first corners are equal.
int MostWithOneCorner(const Triangles& triangles) {
  std::vector<QueryKernel::Point_3> corners;
  corners.reserve(triangles.size());
  for (const auto& triangle : triangles) {
    corners.push_back(triangle.vertex(0));
  }
  std::ranges::sort(corners);
  int most = 0, equal = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    equal = k > 0 && corners[k] == corners[k - 1] ? equal + 1 : 1;
    most = std::max(most, equal);
  }
  return most;
}

}  // namespace

struct MeshQuery::Tree {
  // Rays skip triangles without area, for which CGAL's intersection is undefined; they meet the
  // neighbours instead. Closest points may lie on any triangle.
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

  // CGAL splits the first corners of the triangles until few are left, one call deeper each time,
  // so very many equal ones overflow the stack.
  static constexpr int kMostWithOneCorner = 1000;

  explicit Tree(const TriMesh& mesh)
      : triangles(CopyTriangles(mesh)), tree(triangles.cbegin(), triangles.cend()) {
    tree.build();  // here, so that const queries from several threads never build it
    if (MostWithOneCorner(triangles) <= kMostWithOneCorner) {
      tree.accelerate_distance_queries();
    } else {
      tree.do_not_accelerate_distance_queries();
    }
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
    // A ray in the plane of a triangle meets it in a segment. The segment is left out, because the
    // ray meets the neighbours in points.
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

namespace {

constexpr int kSides = 8;
constexpr double kTilt = 60 * std::numbers::pi / 180;
constexpr double kLift_mm = 1e-3;  // round-off: a ray must not meet the triangle that it leaves

// The normal comes first because it is enough for most of a head.
std::array<Vec3, kSides + 1> Directions(const Vec3& normal) {
  const Vec3 side = normal.unitOrthogonal(), other = normal.cross(side);
  std::array<Vec3, kSides + 1> directions;
  directions[0] = normal;
  for (int k = 0; k < kSides; ++k) {
    const double turn = 2 * std::numbers::pi * k / kSides;
    directions[k + 1] = std::cos(kTilt) * normal +
                        std::sin(kTilt) * (std::cos(turn) * side + std::sin(turn) * other);
  }
  return directions;
}

bool IsSeen(const TriMesh& mesh, const MeshQuery& query, const Triangle& triangle,
            double far_away_mm) {
  const Vec3 area = TriangleAreaVector(mesh, triangle);
  if (area.isZero()) {
    return false;
  }
  const Vec3 normal = area.normalized();
  const Vec3 origin = TriangleCentroid(mesh, triangle) + kLift_mm * normal;
  for (const Vec3& direction : Directions(normal)) {
    if (!query.FirstHit(origin, direction, far_away_mm)) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::vector<bool> SeenFromOutside(const TriMesh& mesh, int threads) {
  const MeshQuery query(mesh);
  const double far_away_mm = Bounds(mesh).diagonal().norm();
  std::vector<std::uint8_t> seen(mesh.triangles.size());  // bytes: threads may write neighbours
  ParallelFor(seen.size(), threads, 256, [&](std::size_t t) {
    seen[t] = IsSeen(mesh, query, mesh.triangles[t], far_away_mm) ? 1 : 0;
  });
  return {seen.begin(), seen.end()};
}

namespace {

using Search = CGAL::Orthogonal_k_neighbor_search<CGAL::Search_traits_3<QueryKernel>>;

std::vector<QueryKernel::Point_3> CopyPoints(std::span<const Vec3> points) {
  if (points.empty()) {
    throw InputError("point query: there are no points; give at least one");
  }
  std::vector<QueryKernel::Point_3> copy;
  copy.reserve(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!points[k].allFinite()) {
      throw InputError(fmt::format("point query: point {} is not finite; leave it out", k));
    }
    copy.push_back(ToCgal(points[k]));
  }
  return copy;
}

}  // namespace

struct PointQuery::Tree {
  explicit Tree(const std::vector<QueryKernel::Point_3>& points)
      : tree(points.begin(), points.end()) {
    tree.build();  // here, so that const queries from several threads never build it
  }
  Search::Tree tree;
};

PointQuery::PointQuery(std::span<const Vec3> points)
    : tree_(std::make_unique<Tree>(CopyPoints(points))) {}
PointQuery::~PointQuery() = default;
PointQuery::PointQuery(PointQuery&&) noexcept = default;
PointQuery& PointQuery::operator=(PointQuery&&) noexcept = default;

double PointQuery::DistanceTo(const Vec3& p, int rank) const {
  if (static_cast<std::size_t>(rank) > tree_->tree.size()) {
    return std::numeric_limits<double>::infinity();
  }
  const Search search(tree_->tree, ToCgal(p), static_cast<unsigned>(rank));
  double farthest = 0;
  for (const auto& [point, squared] : search) {
    farthest = std::max(farthest, squared);
  }
  return std::sqrt(farthest);
}

}  // namespace semblance::surfaces
