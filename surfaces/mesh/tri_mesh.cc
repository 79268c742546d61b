// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/tri_mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace semblance {
namespace {

int Root(std::vector<int>& parent, int i) {
  while (parent[i] != i) {
    parent[i] = parent[parent[i]];
    i = parent[i];
  }
  return i;
}

// An edge as seen from one triangle: the sorted pair of points, and whether the triangle runs from
// the lower to the higher.
struct HalfEdge {
  std::int32_t low, high;
  bool forward;
  auto Key() const { return std::pair(low, high); }
};

std::vector<HalfEdge> SortedHalfEdges(const TriMesh& mesh) {
  std::vector<HalfEdge> half_edges;
  half_edges.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    for (int c = 0; c < 3; ++c) {
      const std::int32_t a = t[c], b = t[(c + 1) % 3];
      half_edges.push_back({std::min(a, b), std::max(a, b), a < b});
    }
  }
  std::sort(half_edges.begin(), half_edges.end(),
            [](const HalfEdge& a, const HalfEdge& b) { return a.Key() < b.Key(); });
  return half_edges;
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
  const std::vector<HalfEdge> half_edges = SortedHalfEdges(mesh);
  EdgeReport report;
  for (std::size_t begin = 0, end = 0; begin < half_edges.size(); begin = end) {
    while (end < half_edges.size() && half_edges[end].Key() == half_edges[begin].Key()) {
      ++end;
    }
    ++report.edges;
    report.boundary += end - begin == 1;
    report.non_manifold += end - begin > 2;
    report.inconsistent +=
        end - begin == 2 && half_edges[begin].forward == half_edges[begin + 1].forward;
  }
  return report;
}

std::vector<MeshEdge> BorderEdges(const TriMesh& mesh) {
  std::vector<MeshEdge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    for (int c = 0; c < 3; ++c) {
      edges.push_back({std::min(t[c], t[(c + 1) % 3]), std::max(t[c], t[(c + 1) % 3])});
    }
  }
  std::sort(edges.begin(), edges.end());
  std::vector<MeshEdge> border;
  for (auto first = edges.begin(); first != edges.end();) {
    const auto last = std::upper_bound(first, edges.end(), *first);
    if (last - first == 1) {
      border.push_back(*first);
    }
    first = last;
  }
  return border;
}

std::vector<std::int32_t> DropUnusedPoints(TriMesh& mesh) {
  std::vector<std::int32_t> renumbered(mesh.points.size(), -1), left;
  for (const Triangle& t : mesh.triangles) {
    for (const std::int32_t v : t) {
      renumbered[v] = 0;
    }
  }
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    if (renumbered[v] == 0) {
      renumbered[v] = static_cast<std::int32_t>(left.size());
      mesh.points[left.size()] = mesh.points[v];
      left.push_back(static_cast<std::int32_t>(v));
    }
  }
  mesh.points.resize(left.size());
  for (Triangle& t : mesh.triangles) {
    t = {renumbered[t[0]], renumbered[t[1]], renumbered[t[2]]};
  }
  return left;
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

TriMesh Transformed(const TriMesh& mesh, const Similarity& to_from) {
  TriMesh result = mesh;
  for (Vec3& p : result.points) {
    p = to_from * p;
  }
  return result;
}

}  // namespace semblance
