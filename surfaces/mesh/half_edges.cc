// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/half_edges.h"

#include <fmt/format.h>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

[[noreturn]] void ThrowNoManifold(const TriMesh& mesh, std::int32_t triangle, const char* who) {
  const Triangle& t = mesh.triangles[triangle];
  throw InputError(
      fmt::format("{}: the mesh is not a consistently oriented manifold at triangle {} {} {}; "
                  "repair it first",
                  who, t[0], t[1], t[2]));
}

// The half-edges that leave each vertex, one vertex after the other.
struct Leaving {
  std::vector<std::int32_t> first;  // of vertex v: first[v] up to first[v + 1]
  std::vector<HalfEdgeIndex> half_edges;
};

Leaving ByStart(const TriMesh& mesh) {
  Leaving leaving;
  leaving.first.assign(mesh.points.size() + 1, 0);
  for (const Triangle& t : mesh.triangles) {
    for (const std::int32_t v : t) {
      ++leaving.first[v + 1];
    }
  }
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    leaving.first[v + 1] += leaving.first[v];
  }
  leaving.half_edges.resize(3 * mesh.triangles.size());
  std::vector<std::int32_t> next(leaving.first.begin(), leaving.first.end() - 1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int side = 0; side < 3; ++side) {
      leaving.half_edges[next[mesh.triangles[t][side]]++] =
          static_cast<HalfEdgeIndex>(4 * t) + side;
    }
  }
  return leaving;
}

}  // namespace

HalfEdges::HalfEdges(const TriMesh& mesh, const char* who)
    : sides_(4 * mesh.triangles.size()), on_border_(mesh.points.size()) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& corners = mesh.triangles[t];
    for (int side = 0; side < 3; ++side) {
      sides_[4 * t + side].from = corners[side];
    }
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
      ThrowNoManifold(mesh, static_cast<std::int32_t>(t), who);
    }
  }
  FindTwins(mesh, who);
  CheckFans(mesh, who);
  for (HalfEdgeIndex h = 0; h < End(); ++h) {
    if (IsAlive(h) && Twin(h) < 0) {
      on_border_[From(h)] = on_border_[To(h)] = true;
    }
  }
}

void HalfEdges::FindTwins(const TriMesh& mesh, const char* who) {
  const Leaving leaving = ByStart(mesh);
  for (const HalfEdgeIndex h : leaving.half_edges) {
    const std::int32_t from = From(h), to = To(h);
    for (int n = leaving.first[from]; n < leaving.first[from + 1]; ++n) {
      if (leaving.half_edges[n] != h && To(leaving.half_edges[n]) == to) {
        ThrowNoManifold(mesh, TriangleOf(h), who);
      }
    }
    for (int n = leaving.first[to]; n < leaving.first[to + 1]; ++n) {
      if (To(leaving.half_edges[n]) == from) {
        sides_[h].twin = leaving.half_edges[n];
      }
    }
  }
}

// Walks each fan once, from its first half-edge or, if it has none, from any: a vertex that is met
// twice has two fans.
void HalfEdges::CheckFans(const TriMesh& mesh, const char* who) const {
  std::vector<bool> seen(sides_.size()), has_fan(mesh.points.size());
  const auto walk = [&](HalfEdgeIndex first) {
    if (has_fan[From(first)]) {
      ThrowNoManifold(mesh, TriangleOf(first), who);
    }
    has_fan[From(first)] = true;
    for (HalfEdgeIndex h = first; h >= 0 && !seen[h]; h = TurnLeft(h)) {
      seen[h] = true;
    }
  };
  for (HalfEdgeIndex h = 0; h < End(); ++h) {
    if (IsAlive(h) && Twin(h) < 0) {
      walk(h);
    }
  }
  for (HalfEdgeIndex h = 0; h < End(); ++h) {
    if (IsAlive(h) && !seen[h]) {
      walk(h);
    }
  }
}

void HalfEdges::Collapse(HalfEdgeIndex h, const std::vector<HalfEdgeIndex>& of_end) {
  const HalfEdgeIndex twin = Twin(h);
  for (const HalfEdgeIndex k : of_end) {
    sides_[k].from = From(h);
  }
  Remove(h);
  if (twin >= 0) {
    Remove(twin);
  }
}

void HalfEdges::Remove(HalfEdgeIndex h) {
  const HalfEdgeIndex a = Twin(Next(h)), b = Twin(Previous(h));
  if (a >= 0) {
    sides_[a].twin = b;
  }
  if (b >= 0) {
    sides_[b].twin = a;
  }
  const HalfEdgeIndex first = 4 * TriangleOf(h);
  sides_[first] = sides_[first + 1] = sides_[first + 2] = {};
}

}  // namespace semblance
