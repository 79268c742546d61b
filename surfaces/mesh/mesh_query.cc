// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/mesh_query.h"

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
#include "surfaces/mesh/triangle_tree.h"

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

const TriMesh& Searchable(const TriMesh& mesh) {
  if (mesh.triangles.empty()) {
    throw InputError("mesh query: the mesh has no triangles; give one with at least one");
  }
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (!mesh.points[i].allFinite()) {
      throw InputError(fmt::format("mesh query: point {} is not finite; repair the mesh first", i));
    }
  }
  return mesh;
}

}  // namespace

struct MeshQuery::Tree : TriangleTree {
  explicit Tree(const TriMesh& mesh) : TriangleTree(Searchable(mesh)) {}

  MeshPoint PointAt(const RayHit& hit, double length_mm) const {
    const auto& [a, b, c] = Corners(hit.triangle);
    return {hit.weights[0] * a + hit.weights[1] * b + hit.weights[2] * c, hit.triangle,
            hit.along * length_mm, hit.weights};
  }
};

MeshQuery::MeshQuery(const TriMesh& mesh) : tree_(std::make_unique<Tree>(mesh)) {}
MeshQuery::~MeshQuery() = default;
MeshQuery::MeshQuery(MeshQuery&&) noexcept = default;
MeshQuery& MeshQuery::operator=(MeshQuery&&) noexcept = default;

MeshPoint MeshQuery::Closest(const Vec3& p) const {
  const int triangle = tree_->Nearest(p);
  const auto& [a, b, c] = tree_->Corners(triangle);
  const TrianglePoint at = ClosestPointOnTriangle(p, a, b, c);
  return {at.position, triangle, (at.position - p).norm(), at.weights};
}

std::vector<int> MeshQuery::TrianglesNear(const Vec3& p, double distance_mm) const {
  std::vector<int> near = tree_->Near(p, distance_mm);
  std::ranges::sort(near);
  return near;
}

std::vector<MeshPoint> MeshQuery::AllHits(const Vec3& origin, const Vec3& direction,
                                          double max_distance_mm) const {
  const Vec3 ray = max_distance_mm * direction.normalized();
  if (ray.isZero(0)) {
    return {};
  }
  std::vector<MeshPoint> hits;
  for (const RayHit& hit : tree_->AllHits(origin, ray)) {
    hits.push_back(tree_->PointAt(hit, max_distance_mm));
  }
  std::sort(hits.begin(), hits.end(), [](const MeshPoint& a, const MeshPoint& b) {
    return std::pair(a.distance_mm, a.triangle) < std::pair(b.distance_mm, b.triangle);
  });
  return hits;
}

std::optional<MeshPoint> MeshQuery::FirstHit(const Vec3& origin, const Vec3& direction,
                                             double max_distance_mm) const {
  const Vec3 ray = max_distance_mm * direction.normalized();
  const RayHit hit = ray.isZero(0) ? RayHit{} : tree_->FirstHit(origin, ray);
  return hit.triangle < 0 ? std::nullopt : std::optional(tree_->PointAt(hit, max_distance_mm));
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

using QueryKernel = CGAL::Simple_cartesian<double>;
using Search = CGAL::Orthogonal_k_neighbor_search<CGAL::Search_traits_3<QueryKernel>>;

QueryKernel::Point_3 ToCgal(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

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
