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

namespace semblance {
namespace {

TriMesh WithDepths(const TriMesh& shell, std::span<const double> depth_mm) {
  std::vector<bool> keep;
  for (const Triangle& t : shell.triangles) {
    keep.push_back(std::all_of(t.begin(), t.end(),
                               [&](std::int32_t v) { return std::isfinite(depth_mm[v]); }));
  }
  return Submesh(shell, keep);
}

using VertexPair = std::pair<std::int32_t, std::int32_t>;  // the lower vertex first

VertexPair SideOf(const Triangle& t, int side) { return std::minmax(t[side], t[(side + 1) % 3]); }

// Where a point is that has the border of a mesh nearest to it, or the inside.
enum class OverBorder { kOver, kBehind, kPastBorder };

// A mesh with a border, and what is nearest to a point on it.
class BorderedMesh {
 public:
  explicit BorderedMesh(const TriMesh& mesh)
      : mesh_(mesh), query_(mesh), on_border_(mesh.points.size(), false) {
    for (const Triangle& t : mesh.triangles) {
      for (int side = 0; side < 3; ++side) {
        ++sides_[SideOf(t, side)];
      }
    }
    for (const auto& [edge, count] : sides_) {
      if (count == 1) {
        on_border_[edge.first] = on_border_[edge.second] = true;
      }
    }
  }

  OverBorder FindPlace(const Vec3& p) const {
    const MeshPoint nearest = query_.Closest(p);
    const Triangle& t = mesh_.triangles[nearest.triangle];
    if (IsAtBorder(t, nearest.position)) {
      return OverBorder::kPastBorder;
    }
    return (p - nearest.position).dot(TriangleAreaVector(mesh_, t)) > 0 ? OverBorder::kOver
                                                                        : OverBorder::kBehind;
  }

 private:
  bool IsAtBorder(const Triangle& t, const Vec3& p) const {
    constexpr double kClose_mm = 1e-6;
    for (int side = 0; side < 3; ++side) {
      const Vec3 &a = mesh_.points[t[side]], &b = mesh_.points[t[(side + 1) % 3]];
      if (on_border_[t[side]] && (p - a).norm() < kClose_mm) {
        return true;
      }
      const Vec3 along = (b - a).normalized(), from = p - a;
      if (sides_.at(SideOf(t, side)) == 1 && (from - from.dot(along) * along).norm() < kClose_mm) {
        return true;
      }
    }
    return false;
  }

  const TriMesh& mesh_;
  MeshQuery query_;
  std::map<VertexPair, int> sides_;  // triangles of each
  std::vector<bool> on_border_;
};

std::vector<OverBorder> PlacesOf(const TriMesh& face, const BorderedMesh& mesh,
                                 const RunContext& context) {
  std::vector<OverBorder> places(face.points.size());
  ParallelFor(face.points.size(), context.threads, 256,
              [&](std::size_t v) { places[v] = mesh.FindPlace(face.points[v]); });
  return places;
}

bool HasCorner(const Triangle& t, const std::vector<OverBorder>& places, OverBorder place) {
  return std::any_of(t.begin(), t.end(), [&](std::int32_t v) { return places[v] == place; });
}

// Triangles that are not past the border: neither with a corner there nor, on the far side, joined
// to such. What seems to be behind elsewhere is beside a sharp edge.
std::vector<bool> TrianglesOver(const TriMesh& face, const std::vector<OverBorder>& places) {
  std::vector<bool> doubtful;
  for (const Triangle& t : face.triangles) {
    doubtful.push_back(HasCorner(t, places, OverBorder::kPastBorder) ||
                       HasCorner(t, places, OverBorder::kBehind));
  }
  const Components pieces = ConnectedComponents(Submesh(face, doubtful));
  std::vector<bool> past(pieces.count, false);
  std::size_t n = 0;  // of the doubtful ones
  for (std::size_t t = 0; t < doubtful.size(); ++t) {
    if (doubtful[t]) {
      const int piece = pieces.of_triangle[n++];
      past[piece] = past[piece] || HasCorner(face.triangles[t], places, OverBorder::kPastBorder);
    }
  }
  std::vector<bool> over;
  n = 0;
  for (const bool doubt : doubtful) {
    over.push_back(!doubt || !past[pieces.of_triangle[n]]);
    n += doubt ? 1 : 0;
  }
  return over;
}

TriMesh LargestPiece(const TriMesh& mesh) {
  const Components pieces = ConnectedComponents(mesh);
  std::vector<double> area(pieces.count, 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    area[pieces.of_triangle[t]] += TriangleAreaVector(mesh, mesh.triangles[t]).norm();
  }
  const auto largest = std::max_element(area.begin(), area.end()) - area.begin();
  std::vector<bool> keep;
  for (const int piece : pieces.of_triangle) {
    keep.push_back(piece == largest);
  }
  return Submesh(mesh, keep);
}

// Gives each fan of triangles at a vertex, but for the first, a vertex of its own: fans that touch
// in one point are no manifold.
void SplitFans(TriMesh& mesh) {
  // Corners of triangles, 3 t + i, are joined where the triangles share a side.
  std::vector<std::int32_t> root(3 * mesh.triangles.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&root](std::int32_t corner) {
    while (root[corner] != corner) {
      corner = root[corner] = root[root[corner]];
    }
    return corner;
  };
  std::map<VertexPair, std::array<std::int32_t, 2>> first;  // of each edge, the corners at its ends
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int side = 0; side < 3; ++side) {
      const auto here = static_cast<std::int32_t>(3 * t + side),
                 next = static_cast<std::int32_t>(3 * t + (side + 1) % 3);
      const Triangle& corners = mesh.triangles[t];
      const bool lower = corners[side] < corners[(side + 1) % 3];
      const std::array<std::int32_t, 2> ends = {lower ? here : next, lower ? next : here};
      const auto [found, is_new] = first.try_emplace(SideOf(corners, side), ends);
      if (!is_new) {
        root[find(ends[0])] = find(found->second[0]);
        root[find(ends[1])] = find(found->second[1]);
      }
    }
  }
  std::vector<std::int32_t> fan_of(mesh.points.size(), -1);  // that keeps the vertex
  std::map<std::int32_t, std::int32_t> own;                  // vertex of a further fan
  for (std::size_t corner = 0; corner < root.size(); ++corner) {
    std::int32_t& v = mesh.triangles[corner / 3][corner % 3];
    const std::int32_t fan = find(static_cast<std::int32_t>(corner));
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
  TriMesh over =
      Submesh(face, TrianglesOver(face, PlacesOf(face, BorderedMesh(with_depths), context)));
  if (over.triangles.empty()) {
    throw InputError(
        "implicit face: nothing of it lies over a part of the shell that has a depth; with "
        "'ends: closed' the whole face is kept");
  }
  SplitFans(over);
  return LargestPiece(over);
}

}  // namespace semblance
