// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/closed_mesh/closed_rings.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <utility>

#include "surfaces/base/geometry.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {
namespace {

// The squared distances from planes, each times an area: x' square x - 2 linear x + constant.
struct Quadric {
  Mat3 square = Mat3::Zero();
  Vec3 linear = Vec3::Zero();
  double constant = 0, area = 0;

  void Add(const Quadric& other) {
    square += other.square;
    linear += other.linear;
    constant += other.constant;
    area += other.area;
  }
  double At(const Vec3& x) const { return x.dot(square * x) - 2 * linear.dot(x) + constant; }
};

Quadric PlaneOf(const Vec3& point, const Vec3& area_vector) {
  const double area = area_vector.norm();
  if (!(area > 0)) {
    return {};
  }
  const Vec3 normal = area_vector / area;
  const double height = normal.dot(point);
  return {.square = area * normal * normal.transpose(),
          .linear = area * height * normal,
          .constant = area * height * height,
          .area = area};
}

std::vector<Quadric> QuadricsOf(const TriMesh& mesh) {
  std::vector<Quadric> quadrics(mesh.points.size());
  for (const Triangle& t : mesh.triangles) {
    const Quadric plane = PlaneOf(mesh.points[t[0]], TriangleAreaVector(mesh, t));
    for (const std::int32_t corner : t) {
      quadrics[corner].Add(plane);
    }
  }
  return quadrics;
}

void Replace(std::int32_t old, std::int32_t by, Ring& ring) {
  *std::find(ring.begin(), ring.end(), old) = by;
}

void TakeOut(std::int32_t vertex, Ring& ring) {
  ring.erase(std::find(ring.begin(), ring.end(), vertex));
}

// Between two that stand side by side in the ring.
void InsertAfter(std::int32_t before, std::int32_t vertex, Ring& ring) {
  ring.insert(std::find(ring.begin(), ring.end(), before) + 1, vertex);
}

bool Contains(const Ring& ring, std::int32_t vertex) {
  return std::find(ring.begin(), ring.end(), vertex) != ring.end();
}

// The ring from that vertex on.
Ring StartingAt(std::int32_t first, Ring ring) {
  std::rotate(ring.begin(), std::find(ring.begin(), ring.end(), first), ring.end());
  return ring;
}

// A vertex, the neighbour that takes its triangles over, and what that costs.
struct Candidate {
  double cost = std::numeric_limits<double>::infinity();
  std::int32_t vertex = -1, to = -1;
};

class Remover {
 public:
  explicit Remover(const TriMesh& mesh)
      : points_(mesh.points), quadrics_(QuadricsOf(mesh)), closed_{.rings = RingsOf(mesh)} {
    for (std::size_t v = 0; v < points_.size(); ++v) {
      left_.push_back(static_cast<std::int32_t>(v));
    }
  }

  ClosedRings Run() && {
    constexpr std::size_t kLast = 4, kUsualDegree = 9;
    for (std::size_t most = kUsualDegree; left_.size() > kLast;) {
      closed_.rounds.push_back(closed_.removals.size());
      // Where every vertex that could go would make one of its neighbours a hub, hubs are allowed.
      if (const bool removed = RunRound(most, left_.size() - kLast); !removed) {
        closed_.rounds.pop_back();
        if (most > points_.size()) {
          break;
        }
        most *= 2;
      }
    }
    return std::move(closed_);
  }

 private:
  bool RunRound(std::size_t most_degree, std::size_t most_removed) {
    constexpr std::size_t kPart = 4;
    const std::size_t most = std::min(most_removed, std::max<std::size_t>(left_.size() / kPart, 1));
    std::vector<Candidate> candidates;
    for (const std::int32_t v : left_) {
      if (const Candidate best = CheapestFor(v, most_degree); best.to >= 0) {
        candidates.push_back(best);
      }
    }
    std::ranges::stable_sort(candidates, {}, &Candidate::cost);
    std::vector<char> stays(points_.size(), 0);
    std::size_t removed = 0;
    for (const Candidate& next : candidates) {
      if (removed < most && !stays[next.vertex] && MayGo(next.vertex, next.to, most_degree)) {
        for (const std::int32_t n : closed_.rings[next.vertex]) {
          stays[n] = 1;
        }
        Remove(next.vertex, next.to);
        ++removed;
      }
    }
    std::erase_if(left_, [&](std::int32_t v) { return closed_.rings[v].empty(); });
    return removed > 0;
  }

  // What is flat goes for the sake of short edges.
  double Cost(std::int32_t vertex, std::int32_t to) const {
    constexpr double kOfLength = 1e-2;
    const Quadric& quadric = quadrics_[vertex];
    return quadric.At(points_[to]) +
           kOfLength * quadric.area * (points_[vertex] - points_[to]).squaredNorm();
  }

  Candidate CheapestFor(std::int32_t vertex, std::size_t most_degree) const {
    Candidate best;
    for (const std::int32_t to : closed_.rings[vertex]) {
      if (const double cost = Cost(vertex, to);
          cost < best.cost && MayGo(vertex, to, most_degree)) {
        best = {cost, vertex, to};
      }
    }
    return best;
  }

  // What is left is a mesh: the two vertices share the neighbours of their edge's triangles alone.
  bool MayGo(std::int32_t vertex, std::int32_t to, std::size_t most_degree) const {
    const Ring &ring = closed_.rings[vertex], &other = closed_.rings[to];
    const auto shared =
        std::ranges::count_if(ring, [&](std::int32_t n) { return Contains(other, n); });
    return shared == 2 && ring.size() + other.size() <= most_degree + 4;
  }

  void Remove(std::int32_t vertex, std::int32_t to) {
    std::vector<Ring>& rings = closed_.rings;
    Removal removal{vertex, StartingAt(to, std::move(rings[vertex]))};
    rings[vertex] = {};
    const Ring& ring = removal.ring;
    Ring& hub = rings[to];
    for (std::size_t k = 2; k + 1 < ring.size(); ++k) {
      Replace(vertex, to, rings[ring[k]]);
      InsertAfter(ring[k - 1], ring[k], hub);
    }
    for (const std::int32_t side : {to, ring[1], ring.back()}) {
      TakeOut(vertex, rings[side]);
    }
    quadrics_[to].Add(quadrics_[vertex]);
    closed_.removals.push_back(std::move(removal));
  }

  const std::vector<Vec3>& points_;
  std::vector<Quadric> quadrics_;
  ClosedRings closed_;
  std::vector<std::int32_t> left_;
};

}  // namespace

std::vector<Ring> RingsOf(const TriMesh& mesh) {
  std::vector<Ring> rings = VertexRings(mesh, "parameters");
  for (Ring& ring : rings) {
    std::rotate(ring.begin(), std::ranges::min_element(ring), ring.end());
  }
  return rings;
}

ClosedRings TakeApart(const TriMesh& mesh) { return Remover(mesh).Run(); }

void PutBack(const Removal& removal, std::vector<Ring>& rings) {
  const auto& [vertex, ring] = removal;
  const std::int32_t to = ring.front();
  InsertAfter(ring[1], vertex, rings[to]);
  InsertAfter(ring[2], vertex, rings[ring[1]]);
  InsertAfter(to, vertex, rings[ring.back()]);
  for (std::size_t k = 2; k + 1 < ring.size(); ++k) {
    Replace(to, vertex, rings[ring[k]]);
    TakeOut(ring[k], rings[to]);
  }
  rings[vertex] = ring;
}

}  // namespace semblance
