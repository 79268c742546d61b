// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/tri_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <unordered_map>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/mesh/half_edge_mesh.h"

namespace semblance::surfaces {
namespace {

int Root(std::vector<int>& parent, int i) {
  while (parent[i] != i) {
    parent[i] = parent[parent[i]];
    i = parent[i];
  }
  return i;
}

// A side of a triangle: its sorted pair of points, and whether the triangle runs from the lower
// point to the higher.
struct TriangleSide {
  std::int32_t low, high;
  bool forward;
};

// The sides of all triangles by their lower point, then their higher one. A point has few sides, so
// counting the sides of each point and sorting those few is much faster than sorting all.
std::vector<TriangleSide> SortedSides(const TriMesh& mesh) {
  const auto for_each_side = [&mesh](const auto& visit) {
    for (const Triangle& t : mesh.triangles) {
      for (int c = 0; c < 3; ++c) {
        const std::int32_t a = t[c], b = t[(c + 1) % 3];
        visit(TriangleSide{std::min(a, b), std::max(a, b), a < b});
      }
    }
  };
  std::vector<std::size_t> end(mesh.points.size() + 1, 0);  // of the sides of each lower point
  for_each_side([&end](const TriangleSide& side) { ++end[side.low + 1]; });
  std::partial_sum(end.begin(), end.end(), end.begin());
  std::vector<TriangleSide> sides(3 * mesh.triangles.size());
  for_each_side([&](const TriangleSide& side) { sides[end[side.low]++] = side; });
  for (std::size_t v = 0, begin = 0; v < mesh.points.size(); begin = end[v++]) {
    std::ranges::sort(std::span(sides).subspan(begin, end[v] - begin), {}, &TriangleSide::high);
  }
  return sides;
}

// Calls visit(first, last) for the sides at each edge, in the order of the edges. Unlike
// half-edges, sorted sides show all triangles of a non-manifold edge.
template <class Visit>
void ForEachEdge(const TriMesh& mesh, const Visit& visit) {
  const std::vector<TriangleSide> sides = SortedSides(mesh);
  for (auto first = sides.cbegin(); first != sides.cend();) {
    const auto last = std::find_if(first, sides.cend(), [&](const TriangleSide& side) {
      return side.low != first->low || side.high != first->high;
    });
    visit(first, last);
    first = last;
  }
}

using FacedCell = std::array<std::int64_t, 4>;  // the cell of the grid, and the side that is faced

struct CellHash {
  std::size_t operator()(const FacedCell& cell) const {
    std::uint64_t hash = 0;
    for (const std::int64_t index : cell) {
      hash = (hash ^ static_cast<std::uint64_t>(index)) * 0x9E3779B97F4A7C15ULL;
      hash ^= hash >> 32;
    }
    return hash;
  }
};

std::int64_t FacedSide(const Vec3& normal) {
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return 2 * axis + (normal[axis] < 0 ? 1 : 0);
}

FacedCell FindFacedCell(const Vec3& p, const Vec3& normal, double cell_mm) {
  if (!p.allFinite()) {
    throw InputError("cluster vertices: a point is not finite; repair the mesh first");
  }
  const auto index = [&](double x) { return static_cast<std::int64_t>(std::floor(x / cell_mm)); };
  return {index(p.x()), index(p.y()), index(p.z()), FacedSide(normal)};
}

}  // namespace

Box3 Bounds(const TriMesh& mesh) {
  Box3 box;
  for (const Vec3& p : mesh.points) {
    box.extend(p);
  }
  return box;
}

Vec3 TriangleCentroid(const TriMesh& mesh, const Triangle& t) {
  return (mesh.points[t[0]] + mesh.points[t[1]] + mesh.points[t[2]]) / 3.0;
}

Vec3 TriangleAreaVector(const TriMesh& mesh, const Triangle& t) {
  const Vec3& a = mesh.points[t[0]];
  return 0.5 * (mesh.points[t[1]] - a).cross(mesh.points[t[2]] - a);
}

double Area(const TriMesh& mesh) {
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    area += TriangleAreaVector(mesh, t).norm();
  }
  return area;
}

std::vector<Vec3> VertexNormals(const TriMesh& mesh) {
  std::vector<Vec3> normals(mesh.points.size(), Vec3::Zero());
  for (const Triangle& t : mesh.triangles) {
    const Vec3 area_vector = TriangleAreaVector(mesh, t);
    for (const std::int32_t corner : t) {
      normals[corner] += area_vector;
    }
  }
  for (Vec3& n : normals) {
    const double length = n.norm();
    n = length > 0 ? Vec3(n / length) : Vec3(Vec3::Zero());
  }
  return normals;
}

std::vector<double> VertexAreas(const TriMesh& mesh) {
  std::vector<double> areas(mesh.points.size(), 0);
  for (const Triangle& t : mesh.triangles) {
    const double third = TriangleAreaVector(mesh, t).norm() / 3;
    for (const std::int32_t v : t) {
      areas[v] += third;
    }
  }
  return areas;
}

Components ConnectedComponents(const TriMesh& mesh) {
  std::vector<int> parent(mesh.points.size());
  std::iota(parent.begin(), parent.end(), 0);
  for (const Triangle& t : mesh.triangles) {
    parent[Root(parent, t[1])] = Root(parent, t[0]);
    parent[Root(parent, t[2])] = Root(parent, t[0]);
  }
  Components components;
  components.of_triangle.reserve(mesh.triangles.size());
  std::vector<int> number(mesh.points.size(), -1);
  for (const Triangle& t : mesh.triangles) {
    int& component = number[Root(parent, t[0])];
    if (component < 0) {
      component = components.count++;
    }
    components.of_triangle.push_back(component);
  }
  return components;
}

EdgeReport CheckEdges(const TriMesh& mesh) {
  EdgeReport report;
  ForEachEdge(mesh, [&](auto first, auto last) {
    ++report.edges;
    report.boundary += last - first == 1;
    report.non_manifold += last - first > 2;
    report.inconsistent += last - first == 2 && first->forward == first[1].forward;
  });
  return report;
}

std::vector<MeshEdge> BorderEdges(const TriMesh& mesh) {
  std::vector<MeshEdge> border;
  ForEachEdge(mesh, [&](auto first, auto last) {
    if (last - first == 1) {
      border.push_back({first->low, first->high});
    }
  });
  return border;
}

std::vector<VertexLoop> BorderLoops(const TriMesh& mesh, const char* caller) {
  const HalfEdgeMesh half_edges = MakeManifold(mesh, caller);
  std::vector<VertexLoop> loops;
  std::vector<bool> visited(mesh.points.size(), false);
  for (const OpenMesh::VertexHandle start : half_edges.vertices()) {
    if (visited[start.idx()] || half_edges.is_isolated(start) || !half_edges.is_boundary(start)) {
      continue;
    }
    VertexLoop& loop = loops.emplace_back();
    // The half-edge of a border vertex runs along the border with the surface on its right, so the
    // loop goes backwards.
    for (OpenMesh::VertexHandle v = start; !visited[v.idx()];
         v = half_edges.from_vertex_handle(
             half_edges.prev_halfedge_handle(half_edges.halfedge_handle(v)))) {
      visited[v.idx()] = true;
      loop.push_back(v.idx());
    }
  }
  return loops;
}

std::vector<VertexLoop> VertexRings(const TriMesh& mesh, const char* caller) {
  const HalfEdgeMesh half_edges = MakeManifold(mesh, caller);
  std::vector<VertexLoop> rings;
  for (const OpenMesh::VertexHandle v : half_edges.vertices()) {
    VertexLoop& ring = rings.emplace_back();
    if (half_edges.is_isolated(v)) {
      continue;
    }
    // On a border OpenMesh's half-edge of the vertex is the last one counter-clockwise.
    const OpenMesh::HalfedgeHandle last = half_edges.halfedge_handle(v);
    for (OpenMesh::HalfedgeHandle h = half_edges.ccw_rotated_halfedge_handle(last); h != last;
         h = half_edges.ccw_rotated_halfedge_handle(h)) {
      ring.push_back(half_edges.to_vertex_handle(h).idx());
    }
    ring.push_back(half_edges.to_vertex_handle(last).idx());
  }
  return rings;
}

std::vector<std::int32_t> DropUnusedPoints(TriMesh& mesh) {
  std::vector<std::int32_t> renumbered(mesh.points.size(), -1), former;
  for (const Triangle& t : mesh.triangles) {
    for (const std::int32_t v : t) {
      renumbered[v] = 0;
    }
  }
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    if (renumbered[v] == 0) {
      renumbered[v] = static_cast<std::int32_t>(former.size());
      mesh.points[former.size()] = mesh.points[v];
      former.push_back(static_cast<std::int32_t>(v));
    }
  }
  mesh.points.resize(former.size());
  for (Triangle& t : mesh.triangles) {
    t = {renumbered[t[0]], renumbered[t[1]], renumbered[t[2]]};
  }
  return former;
}

TriMesh Submesh(const TriMesh& mesh, const std::vector<bool>& keep) {
  TriMesh result{mesh.points, {}};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (keep[t]) {
      result.triangles.push_back(mesh.triangles[t]);
    }
  }
  DropUnusedPoints(result);
  return result;
}

TriMesh ClusterVertices(const TriMesh& mesh, double cell_mm) {
  if (!(cell_mm > 0)) {
    throw InputError(fmt::format("cluster vertices: cell_mm is {}; it must be positive", cell_mm));
  }
  const std::vector<Vec3> normals = VertexNormals(mesh);
  // Numbered in the order of their first vertices.
  std::unordered_map<FacedCell, std::int32_t, CellHash> clusters;
  std::vector<std::int32_t> cluster_of(mesh.points.size());
  TriMesh coarse;
  std::vector<double> members;
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    const auto [it, is_new] =
        clusters.try_emplace(FindFacedCell(mesh.points[v], normals[v], cell_mm),
                             static_cast<std::int32_t>(clusters.size()));
    if (is_new) {
      coarse.points.emplace_back(Vec3::Zero());
      members.push_back(0);
    }
    cluster_of[v] = it->second;
    coarse.points[it->second] += mesh.points[v];
    members[it->second] += 1;
  }
  for (std::size_t c = 0; c < members.size(); ++c) {
    coarse.points[c] /= members[c];
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    const Triangle t = {cluster_of[a], cluster_of[b], cluster_of[c]};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) {
      coarse.triangles.push_back(t);
    }
  }
  return coarse;
}

TriMesh Transformed(const TriMesh& mesh, const Similarity& to_from) {
  TriMesh result = mesh;
  for (Vec3& p : result.points) {
    p = to_from * p;
  }
  return result;
}

}  // namespace semblance::surfaces
