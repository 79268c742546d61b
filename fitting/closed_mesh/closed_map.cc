// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/closed_mesh/closed_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fitting/closed_mesh/closed_rings.h"
#include "fitting/closed_mesh/mesh_pieces.h"
#include "fitting/closed_mesh/pole_axis.h"
#include "fitting/closed_mesh/sphere_relaxer.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

constexpr char kRefused[] = "parameters: the mesh cannot be laid out on the sphere";

[[noreturn]] void FailLayout(const std::string& what) {
  throw InputError(fmt::format("{}: {}", kRefused, what));
}

void CheckLayout(const TriMesh& mesh) {
  constexpr std::size_t kFewest = 4;
  CheckOnePiece(mesh, kRefused);
  const EdgeReport edges = CheckEdges(mesh);
  if (edges.boundary > 0) {
    FailLayout(fmt::format(
        "it has a border ({} edges with one triangle); write closure: open, or fill the holes",
        edges.boundary));
  }
  if (edges.non_manifold > 0 || edges.inconsistent > 0) {
    FailLayout(fmt::format(
        "it is not a consistently oriented manifold ({} edges with more than two triangles, {} "
        "with two that run against each other); repair it first",
        edges.non_manifold, edges.inconsistent));
  }
  const auto count = [](std::size_t n) { return static_cast<std::int64_t>(n); };
  if (const std::int64_t euler =
          count(mesh.points.size()) - edges.edges + count(mesh.triangles.size());
      euler < 2) {
    FailLayout(
        fmt::format("it has {} handles, or triangles that meet in a point alone; if it is a "
                    "ring, take parameters: torus with closure: periodic_uv, else cut the "
                    "handles open and close the cuts",
                    (2 - euler + 1) / 2));
  }
  if (mesh.points.size() < kFewest || !(Area(mesh) > 0)) {
    FailLayout("it encloses nothing; give another one");
  }
}

// Points by their places, triangles by their corners, the least first. Returns the points' old
// indices.
std::vector<std::int32_t> Sort(TriMesh& mesh) {
  const std::vector<Vec3> points = mesh.points;
  std::vector<std::int32_t> order(points.size()), place(points.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, [&](std::int32_t a, std::int32_t b) {
    return std::ranges::lexicographical_compare(points[a], points[b]);
  });
  for (std::size_t k = 0; k < order.size(); ++k) {
    place[order[k]] = static_cast<std::int32_t>(k);
    mesh.points[k] = points[order[k]];
  }
  for (Triangle& t : mesh.triangles) {
    t = {place[t[0]], place[t[1]], place[t[2]]};
    std::rotate(t.begin(), std::ranges::min_element(t), t.end());
  }
  std::ranges::sort(mesh.triangles);
  return order;
}

// Of the triangles around the vertices.
double AreaOf(std::span<const Vec3> points, const std::vector<Ring>& rings,
              std::span<const std::int32_t> vertices) {
  double area = 0;
  for (const std::int32_t v : vertices) {
    const Ring& ring = rings[v];
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const std::int32_t next = ring[(k + 1) % ring.size()];
      area += (points[ring[k]] - points[v]).cross(points[next] - points[v]).norm() / 6;
    }
  }
  return area;
}

class Layout {
 public:
  explicit Layout(const TriMesh& mesh)
      : points_(mesh.points), closed_(TakeApart(mesh)), at_(mesh.points.size(), Vec3::Zero()) {
    for (std::size_t v = 0; v < closed_.rings.size(); ++v) {
      if (!closed_.rings[v].empty()) {
        there_.push_back(static_cast<std::int32_t>(v));
      }
    }
  }

  std::vector<Vec3> Run() && {
    PlaceTetrahedron();
    while (!closed_.rounds.empty()) {
      PutBackRound();
      Relax();
    }
    return std::move(at_);
  }

 private:
  void PlaceTetrahedron() {
    const std::int32_t top = there_.front();
    const Ring& others = closed_.rings[top];
    const std::array<Vec3, 3> places = {Vec3(-1, -1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1)};
    at_[top] = Vec3(1, 1, 1).normalized();
    for (std::size_t k = 0; k < places.size(); ++k) {
      at_[others[k]] = places[k].normalized();
    }
  }

  SphereRelaxer Relaxer() {
    const double area = AreaOf(points_, closed_.rings, there_);
    return {points_, closed_.rings, std::sqrt(4 * std::numbers::pi / area), at_};
  }

  void PutBackRound() {
    SphereRelaxer relaxer = Relaxer();
    for (const std::size_t begin = closed_.rounds.back(); closed_.removals.size() > begin;) {
      const Removal removal = std::move(closed_.removals.back());
      closed_.removals.pop_back();
      PutBack(removal, closed_.rings);
      relaxer.Place(removal);
      there_.push_back(removal.vertex);
    }
    closed_.rounds.pop_back();
    std::ranges::sort(there_);  // neighbours stand together in memory: a sweep takes half as long
  }

  // What is wrong over long distances is set right while there are few vertices. So a few sweeps do
  // where there are many, and some more once all are there, for the map is to be smooth.
  void Relax() {
    constexpr std::size_t kFewest = 6, kMost = 200, kMoves = 20000, kLast = 20;
    const std::size_t sweeps =
        closed_.rounds.empty() ? kLast : std::clamp(kMoves / there_.size(), kFewest, kMost);
    SphereRelaxer relaxer = Relaxer();
    for (std::size_t sweep = 0; sweep < sweeps; ++sweep) {
      for (const std::int32_t v : there_) {
        relaxer.Move(v);
      }
    }
  }

  std::span<const Vec3> points_;
  ClosedRings closed_;
  std::vector<std::int32_t> there_;  // vertices
  std::vector<Vec3> at_;
};

void AddFaults(const TriMesh& mesh, std::span<const Vec3> at, ClosedLayout& layout) {
  constexpr double kLeastArea = 1.0 / 40;
  const double area = Area(mesh);
  layout.folded = layout.collapsed = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = at[t[0]], &b = at[t[1]], &c = at[t[2]];
    const double share = TriangleAreaVector(mesh, t).norm() / area,
                 left = a.dot((b - a).cross(c - a)) / 2 / (4 * std::numbers::pi);
    if (!(left > 0)) {
      layout.folded += share;
    } else if (left < kLeastArea * share) {
      layout.collapsed += share;
    }
  }
}

}  // namespace

bool IsClosed(std::span<const Triangle> triangles) {
  return !triangles.empty() &&
         CheckEdges({.points = {}, .triangles = {triangles.begin(), triangles.end()}}).boundary ==
             0;
}

ClosedLayout LayOutOnSphere(const TriMesh& mesh) {
  CheckLayout(mesh);
  TriMesh sorted = mesh;
  const std::vector<std::int32_t> order = Sort(sorted);
  const std::vector<Vec3> at = Layout(sorted).Run();
  ClosedLayout layout{.at = std::vector<Vec3>(at.size()), .axis = LeastDistortedAxis(sorted, at)};
  for (std::size_t k = 0; k < order.size(); ++k) {
    layout.at[order[k]] = at[k];
  }
  AddFaults(sorted, at, layout);
  return layout;
}

}  // namespace semblance
