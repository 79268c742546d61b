// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/implicit/trim_to_border.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::surfaces {
namespace {

TriMesh WithDepths(const TriMesh& shell, std::span<const double> depth_mm) {
  std::vector<bool> keep;
  for (const Triangle& t : shell.triangles) {
    keep.push_back(std::all_of(t.begin(), t.end(),
                               [&](std::int32_t v) { return std::isfinite(depth_mm[v]); }));
  }
  return Submesh(shell, keep);
}

using VertexPair = std::pair<std::int32_t, std::int32_t>;  // lower vertex first

VertexPair SortedEdge(const Triangle& t, int e) { return std::minmax(t[e], t[(e + 1) % 3]); }

// The part of a mesh with a border that is nearest to a point.
enum class Nearest { kFront, kBack, kBorder };

class BorderedMesh {
 public:
  explicit BorderedMesh(const TriMesh& mesh)
      : mesh_(mesh), query_(mesh), on_border_(mesh.points.size(), false) {
    for (const Triangle& t : mesh.triangles) {
      for (int e = 0; e < 3; ++e) {
        ++triangles_at_[SortedEdge(t, e)];
      }
    }
    for (const auto& [edge, count] : triangles_at_) {
      if (count == 1) {
        on_border_[edge.first] = on_border_[edge.second] = true;
      }
    }
  }

  Nearest NearestTo(const Vec3& p) const {
    const MeshPoint nearest = query_.Closest(p);
    const Triangle& t = mesh_.triangles[nearest.triangle];
    if (IsAtBorder(t, nearest.position)) {
      return Nearest::kBorder;
    }
    const bool in_front = (p - nearest.position).dot(TriangleAreaVector(mesh_, t)) > 0;
    return in_front ? Nearest::kFront : Nearest::kBack;
  }

 private:
  bool IsAtBorder(const Triangle& t, const Vec3& p) const {
    constexpr double kClose_mm = 1e-6;
    for (int e = 0; e < 3; ++e) {
      const Vec3 &a = mesh_.points[t[e]], &b = mesh_.points[t[(e + 1) % 3]];
      if (on_border_[t[e]] && (p - a).norm() < kClose_mm) {
        return true;
      }
      const Vec3 along = (b - a).normalized(), from = p - a;
      const bool is_border = triangles_at_.at(SortedEdge(t, e)) == 1;
      if (is_border && (from - from.dot(along) * along).norm() < kClose_mm) {
        return true;
      }
    }
    return false;
  }

  const TriMesh& mesh_;
  MeshQuery query_;
  std::map<VertexPair, int> triangles_at_;  // number of triangles per edge
  std::vector<bool> on_border_;
};

std::vector<Nearest> NearestToVertices(const TriMesh& face, const BorderedMesh& mesh,
                                       const RunContext& context) {
  std::vector<Nearest> nearest(face.points.size());
  ParallelFor(face.points.size(), context.threads, 256,
              [&](std::size_t v) { nearest[v] = mesh.NearestTo(face.points[v]); });
  return nearest;
}

bool HasCorner(const Triangle& t, const std::vector<Nearest>& nearest, Nearest kind) {
  return std::any_of(t.begin(), t.end(), [&](std::int32_t v) { return nearest[v] == kind; });
}

// Selects the triangles over the mesh. A triangle is dropped if a corner is nearest to the border,
// or if it is connected to such a triangle through triangles with corners behind the mesh.
// Elsewhere a corner that seems to lie behind the mesh is beside a sharp edge, and its triangle is
// kept.
std::vector<bool> TrianglesOver(const TriMesh& face, const std::vector<Nearest>& nearest) {
  std::vector<bool> doubtful;
  for (const Triangle& t : face.triangles) {
    doubtful.push_back(HasCorner(t, nearest, Nearest::kBorder) ||
                       HasCorner(t, nearest, Nearest::kBack));
  }
  const Components parts = ConnectedComponents(Submesh(face, doubtful));
  std::vector<bool> past(parts.count, false);
  std::size_t n = 0;  // counts doubtful triangles
  for (std::size_t t = 0; t < doubtful.size(); ++t) {
    if (doubtful[t]) {
      const int part = parts.of_triangle[n++];
      past[part] = past[part] || HasCorner(face.triangles[t], nearest, Nearest::kBorder);
    }
  }
  std::vector<bool> over;
  n = 0;
  for (const bool doubt : doubtful) {
    over.push_back(!doubt || !past[parts.of_triangle[n]]);
    n += doubt ? 1 : 0;
  }
  return over;
}

TriMesh LargestPart(const TriMesh& mesh) {
  const Components parts = ConnectedComponents(mesh);
  std::vector<double> area(parts.count, 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    area[parts.of_triangle[t]] += TriangleAreaVector(mesh, mesh.triangles[t]).norm();
  }
  const auto largest = std::max_element(area.begin(), area.end()) - area.begin();
  std::vector<bool> keep;
  for (const int part : parts.of_triangle) {
    keep.push_back(part == largest);
  }
  return Submesh(mesh, keep);
}

// The fans of triangles around each vertex, as disjoint sets of the corners 3 t + i. Two corners at
// a vertex belong to one fan if their triangles share an edge there.
class CornerFans {
 public:
  explicit CornerFans(const TriMesh& mesh) : parent_(3 * mesh.triangles.size()) {
    std::iota(parent_.begin(), parent_.end(), 0);
    std::map<VertexPair, std::array<std::int32_t, 2>> first;  // per edge, the corners at its ends
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (int e = 0; e < 3; ++e) {
        const Triangle& corners = mesh.triangles[t];
        std::array<std::int32_t, 2> ends = {static_cast<std::int32_t>(3 * t + e),
                                            static_cast<std::int32_t>(3 * t + (e + 1) % 3)};
        if (corners[e] > corners[(e + 1) % 3]) {
          std::swap(ends[0], ends[1]);
        }
        const auto [found, is_new] = first.try_emplace(SortedEdge(corners, e), ends);
        if (!is_new) {
          parent_[Of(ends[0])] = Of(found->second[0]);
          parent_[Of(ends[1])] = Of(found->second[1]);
        }
      }
    }
  }

  std::int32_t Of(std::int32_t corner) {
    while (parent_[corner] != corner) {
      corner = parent_[corner] = parent_[parent_[corner]];
    }
    return corner;
  }

 private:
  std::vector<std::int32_t> parent_;
};

// Gives each fan at a vertex except the first its own vertex, because fans that share only a vertex
// are not a manifold.
void SplitFans(TriMesh& mesh) {
  CornerFans fans(mesh);
  std::vector<std::int32_t> fan_of(mesh.points.size(), -1);  // the fan that keeps the vertex
  std::map<std::int32_t, std::int32_t> own;                  // the vertex of another fan
  const auto corner_count = static_cast<std::int32_t>(3 * mesh.triangles.size());
  for (std::int32_t corner = 0; corner < corner_count; ++corner) {
    std::int32_t& v = mesh.triangles[corner / 3][corner % 3];
    const std::int32_t fan = fans.Of(corner);
    if (fan_of[v] < 0) {
      fan_of[v] = fan;
    }
    if (fan_of[v] != fan) {
      const auto [found, is_new] =
          own.try_emplace(fan, static_cast<std::int32_t>(mesh.points.size()));
      if (is_new) {
        mesh.points.push_back(Vec3(mesh.points[v]));
        fan_of.push_back(fan);
      }
      v = found->second;
    }
  }
}

}  // namespace

TriMesh TrimToSkull(const TriMesh& face, const TriMesh& shell, std::span<const double> depth_mm,
                    const RunContext& context) {
  const TriMesh with_depths = WithDepths(shell, depth_mm);
  const std::vector<Nearest> nearest = NearestToVertices(face, BorderedMesh(with_depths), context);
  TriMesh over = Submesh(face, TrianglesOver(face, nearest));
  if (over.triangles.empty()) {
    throw InputError(
        "implicit face: no part of it lies over a part of the shell that has a depth; use "
        "'ends: closed' to keep the whole face");
  }
  SplitFans(over);
  return LargestPart(over);
}

}  // namespace semblance::surfaces
