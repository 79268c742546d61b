// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include "surfaces/mesh/mesh_query.h"

namespace semblance::surfaces {
namespace {

constexpr double kRoundOff = 1e-12;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

float RoundDown(double x) {
  const auto f = static_cast<float>(x);
  return f > x ? std::nextafter(f, -std::numeric_limits<float>::infinity()) : f;
}
float RoundUp(double x) { return -RoundDown(-x); }

}  // namespace

// ---------------------------------------------------------------------------------------------
// The tree
// ---------------------------------------------------------------------------------------------

// The margin keeps triangles inside their box: a ray in a side of a box would end there.
TriangleTree::TriangleTree(const TriMesh& mesh)
    : margin_mm_(1e-7 * Bounds(mesh).diagonal().norm()), place_(mesh.triangles.size()) {
  std::vector<Item> items;
  items.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    items.push_back({TriangleCentroid(mesh, t), static_cast<std::int32_t>(items.size())});
  }
  nodes_.reserve(items.size());
  corners_.reserve(items.size());
  triangle_.reserve(items.size());
  Build(mesh, items, 0, items.size());
  nodes_.shrink_to_fit();
}

// Parts items[begin, end) and returns the begin of the second part: at the middle of the longest
// side of the box of their centres or, if few lie on one side of it, at their median. The middle
// is found faster, and the median bounds the depth of the tree.
std::size_t TriangleTree::Split(std::vector<Item>& items, std::size_t begin, std::size_t end) {
  constexpr std::size_t kFew = 4;  // at least one item in so many on each side
  const auto at = [&items](std::size_t k) {
    return items.begin() + static_cast<std::ptrdiff_t>(k);
  };
  Box3 centres;
  for (std::size_t k = begin; k < end; ++k) {
    centres.extend(items[k].centre);
  }
  Eigen::Index axis = 0;
  centres.sizes().maxCoeff(&axis);
  const double half_way = centres.center()[axis];
  const auto second = std::partition(
      at(begin), at(end), [&](const Item& item) { return item.centre[axis] < half_way; });
  const auto place = static_cast<std::size_t>(second - items.begin());
  const std::size_t few = (end - begin) / kFew;
  if (place - begin >= few && end - place >= few) {
    return place;
  }
  const std::size_t median = begin + (end - begin) / 2;
  std::nth_element(at(begin), at(median), at(end), [axis](const Item& a, const Item& b) {
    return a.centre[axis] < b.centre[axis];
  });
  return median;
}

// Appends the box of items[begin, end) and everything below it. Returns its index.
std::int32_t TriangleTree::Build(const TriMesh& mesh, std::vector<Item>& items, std::size_t begin,
                                 std::size_t end) {
  const auto index = static_cast<std::int32_t>(nodes_.size());
  nodes_.emplace_back();
  if (end - begin <= kLeafTriangles) {
    Box3 box;
    nodes_[index].next = static_cast<std::int32_t>(corners_.size());
    nodes_[index].count = static_cast<std::int32_t>(end - begin);
    for (std::size_t k = begin; k < end; ++k) {
      const Triangle& t = mesh.triangles[items[k].triangle];
      place_[items[k].triangle] = static_cast<std::int32_t>(corners_.size());
      triangle_.push_back(items[k].triangle);
      corners_.push_back({mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]});
      for (const Vec3& corner : corners_.back()) {
        box.extend(corner);
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      nodes_[index].low[axis] = RoundDown(box.min()[axis] - margin_mm_);
      nodes_[index].high[axis] = RoundUp(box.max()[axis] + margin_mm_);
    }
    return index;
  }
  const std::size_t middle = Split(items, begin, end);
  const std::int32_t first = Build(mesh, items, begin, middle);
  const std::int32_t second = Build(mesh, items, middle, end);
  Node& node = nodes_[index];
  node.next = second;
  for (int k = 0; k < 3; ++k) {
    node.low[k] = std::min(nodes_[first].low[k], nodes_[second].low[k]);
    node.high[k] = std::max(nodes_[first].high[k], nodes_[second].high[k]);
  }
  return index;
}

double TriangleTree::Node::SquaredDistance(const Vec3& p) const {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double outside = std::max({low[axis] - p[axis], p[axis] - high[axis], 0.0});
    sum += outside * outside;
  }
  return sum;
}

// ---------------------------------------------------------------------------------------------
// Closest points
// ---------------------------------------------------------------------------------------------

namespace {

// The squared distance of p from the triangle, by the region of its plane that p lies in front of
// (Ericson, Real-Time Collision Detection, 5.1.5). Faster than ClosestPointOnTriangle, which a
// triangle with hardly any area needs.
double SquaredDistance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  constexpr double kSliver = 1e-14;
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) {
    return ap.squaredNorm();
  }
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) {
    return bp.squaredNorm();
  }
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) {
    return cp.squaredNorm();
  }
  const double of_c = d1 * d4 - d3 * d2, of_b = d5 * d2 - d1 * d6, of_a = d3 * d6 - d5 * d4;
  if (!(of_a + of_b + of_c > kSliver * ab.squaredNorm() * ac.squaredNorm())) {
    return (ClosestPointOnTriangle(p, a, b, c).position - p).squaredNorm();
  }
  if (of_c <= 0 && d1 >= 0 && d3 <= 0) {
    return (ap - d1 / (d1 - d3) * ab).squaredNorm();
  }
  if (of_b <= 0 && d2 >= 0 && d6 <= 0) {
    return (ap - d2 / (d2 - d6) * ac).squaredNorm();
  }
  if (of_a <= 0 && d4 >= d3 && d5 >= d6) {
    return (bp - (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b)).squaredNorm();
  }
  const double scale = 1 / (of_a + of_b + of_c);
  return (ap - scale * of_b * ab - scale * of_c * ac).squaredNorm();
}

}  // namespace

int TriangleTree::Nearest(const Vec3& p) const {
  struct Waiting {
    std::int32_t node;
    double distance2;
  };
  std::array<Waiting, kMostLevels> waiting;  // each level adds one
  int count = 0;
  waiting[count++] = {0, nodes_[0].SquaredDistance(p)};
  double best2 = kInfinity;
  int best = -1;
  while (count > 0) {
    auto [index, distance2] = waiting[--count];
    while (distance2 <= best2 && nodes_[index].count == 0) {
      std::int32_t near = index + 1, far = nodes_[index].next;
      double near2 = nodes_[near].SquaredDistance(p), far2 = nodes_[far].SquaredDistance(p);
      if (far2 < near2) {
        std::swap(near, far);
        std::swap(near2, far2);
      }
      if (far2 <= best2) {
        waiting[count++] = {far, far2};
      }
      index = near;
      distance2 = near2;
    }
    if (distance2 > best2) {
      continue;
    }
    const Node& leaf = nodes_[index];
    for (std::int32_t k = leaf.next; k < leaf.next + leaf.count; ++k) {
      const auto& [a, b, c] = corners_[k];
      const double d2 = SquaredDistance(p, a, b, c);
      if (d2 < best2 || (d2 == best2 && triangle_[k] < best)) {
        best2 = d2;
        best = triangle_[k];
      }
    }
  }
  return best;
}

std::vector<int> TriangleTree::Near(const Vec3& p, double distance_mm) const {
  const double reach2 = distance_mm * distance_mm;
  std::vector<int> near;
  std::vector<std::int32_t> waiting = {0};
  while (!waiting.empty()) {
    const std::int32_t index = waiting.back();
    const Node& node = nodes_[index];
    waiting.pop_back();
    if (node.SquaredDistance(p) > reach2) {
      continue;
    }
    if (node.count == 0) {
      waiting.insert(waiting.end(), {index + 1, node.next});
    } else {
      near.insert(near.end(), &triangle_[node.next], &triangle_[node.next] + node.count);
    }
  }
  return near;
}

// ---------------------------------------------------------------------------------------------
// Rays
// ---------------------------------------------------------------------------------------------

// A ray, and the shear that turns it onto the axis in which it is longest.
struct TriangleTree::Ray {
  Vec3 origin, inverse;
  Eigen::Index x = 0, y = 1, z = 2;
  double shear_x = 0, shear_y = 0, scale = 0;

  Ray(const Vec3& from, const Vec3& direction) : origin(from) {
    // A direction of zero along an axis becomes tiny instead, so that no product is 0 times
    // infinity.
    constexpr double kTiny = 1e-300;
    for (int axis = 0; axis < 3; ++axis) {
      const double d = direction[axis];
      inverse[axis] = 1 / (std::abs(d) < kTiny ? std::copysign(kTiny, d) : d);
    }
    direction.cwiseAbs().maxCoeff(&z);
    x = (z + 1) % 3;
    y = (x + 1) % 3;
    shear_x = direction[x] / direction[z];
    shear_y = direction[y] / direction[z];
    scale = 1 / direction[z];
  }

  // Returns whether the ray meets the box before `last`.
  bool Meets(const Node& node, double last) const {
    double entry = 0, exit = last;
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (node.low[axis] - origin[axis]) * inverse[axis];
      const double b = (node.high[axis] - origin[axis]) * inverse[axis];
      entry = std::max(entry, std::min(a, b));
      exit = std::min(exit, std::max(a, b));
    }
    return entry <= exit + kRoundOff * (1 + std::abs(exit));
  }

  // A ray that passes a corner or a border within round-off meets it.
  std::optional<RayHit> Meet(const std::array<Vec3, 3>& corners) const {
    std::array<double, 3> px, py, pz;
    for (int k = 0; k < 3; ++k) {
      const Vec3 p = corners[k] - origin;
      px[k] = p[x] - shear_x * p[z];
      py[k] = p[y] - shear_y * p[z];
      pz[k] = scale * p[z];
    }
    const Vec3 areas(px[2] * py[1] - py[2] * px[1], px[0] * py[2] - py[0] * px[2],
                     px[1] * py[0] - py[1] * px[0]);
    const double sum = areas.sum();
    if (sum == 0) {
      return std::nullopt;
    }
    Vec3 weights = areas / sum;
    if (!(weights.minCoeff() >= -kRoundOff)) {
      return std::nullopt;
    }
    weights = weights.cwiseMax(0);
    weights /= weights.sum();
    const double along = weights[0] * pz[0] + weights[1] * pz[1] + weights[2] * pz[2];
    return along >= 0 && along <= 1 ? std::optional(RayHit{along, -1, weights}) : std::nullopt;
  }
};

// Calls visit(hit) for each hit until the end of the ray. It returns the new end.
template <class Visit>
void TriangleTree::VisitHits(const Ray& ray, const Visit& visit) const {
  std::array<std::int32_t, kMostLevels> waiting;  // each level adds one
  int count = 0;
  waiting[count++] = 0;
  double last = 1;
  while (count > 0) {
    const std::int32_t index = waiting[--count];
    const Node& node = nodes_[index];
    if (!ray.Meets(node, last)) {
      continue;
    }
    if (node.count == 0) {
      waiting[count++] = node.next;
      waiting[count++] = index + 1;
      continue;
    }
    for (std::int32_t k = node.next; k < node.next + node.count; ++k) {
      if (std::optional<RayHit> hit = ray.Meet(corners_[k])) {
        hit->triangle = triangle_[k];
        last = visit(*hit);
      }
    }
  }
}

std::vector<RayHit> TriangleTree::AllHits(const Vec3& origin, const Vec3& direction) const {
  std::vector<RayHit> hits;
  VisitHits(Ray(origin, direction), [&hits](const RayHit& hit) {
    hits.push_back(hit);
    return 1.0;
  });
  return hits;
}

RayHit TriangleTree::FirstHit(const Vec3& origin, const Vec3& direction) const {
  RayHit first{.along = 1};
  VisitHits(Ray(origin, direction), [&first](const RayHit& hit) {
    if (first.triangle < 0 ||
        std::tuple(hit.along, hit.triangle) < std::tuple(first.along, first.triangle)) {
      first = hit;
    }
    return first.along;
  });
  return first;
}

}  // namespace semblance::surfaces
