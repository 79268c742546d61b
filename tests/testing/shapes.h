// SPDX-License-Identifier: GPL-3.0-or-later
// Small named meshes for tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "surfaces/base/random.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::testing {
using namespace problems;

// The unit-square plate [0,size] x [0,size] at z = 0, normals up, in n x n squares of two triangles
// each.
inline TriMesh Plate(double size, int n) {
  TriMesh mesh;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      mesh.points.emplace_back(size * i / n, size * j / n, 0);
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const int a = i + (n + 1) * j, b = a + 1, c = a + n + 1, d = c + 1;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
  }
  return mesh;
}

// A closed sphere of latitude rings, outward normals.
inline TriMesh SphereMesh(const Vec3& center, double radius, int rings) {
  const int columns = 2 * rings;
  TriMesh mesh;
  mesh.points.push_back(center + Vec3(0, 0, radius));
  for (int r = 1; r < rings; ++r) {
    const double theta = std::numbers::pi * r / rings;
    for (int c = 0; c < columns; ++c) {
      const double phi = 2 * std::numbers::pi * c / columns;
      mesh.points.push_back(center + radius * Vec3(std::sin(theta) * std::cos(phi),
                                                   std::sin(theta) * std::sin(phi),
                                                   std::cos(theta)));
    }
  }
  mesh.points.push_back(center - Vec3(0, 0, radius));
  const auto at = [&](int r, int c) { return 1 + (r - 1) * columns + (c % columns); };
  const int last = static_cast<int>(mesh.points.size()) - 1;
  for (int c = 0; c < columns; ++c) {
    mesh.triangles.push_back({0, at(1, c), at(1, c + 1)});
    mesh.triangles.push_back({last, at(rings - 1, c + 1), at(rings - 1, c)});
    for (int r = 1; r + 1 < rings; ++r) {
      mesh.triangles.push_back({at(r, c), at(r + 1, c), at(r + 1, c + 1)});
      mesh.triangles.push_back({at(r, c), at(r + 1, c + 1), at(r, c + 1)});
    }
  }
  return mesh;
}

// A torus of n x n squares of two triangles each, outward normals.
inline TriMesh RingMesh(int n) {
  TriMesh mesh;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const double p = 2 * std::numbers::pi * i / n, t = 2 * std::numbers::pi * j / n;
      mesh.points.emplace_back((30 + 10 * std::cos(t)) * std::cos(p),
                               (30 + 10 * std::cos(t)) * std::sin(p), 10 * std::sin(t));
      const int a = i + n * j, b = (i + 1) % n + n * j, c = i + n * ((j + 1) % n),
                d = (i + 1) % n + n * ((j + 1) % n);
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
  }
  return mesh;
}

// One mesh with two separate parts.
inline TriMesh Joined(TriMesh a, const TriMesh& b) {
  const auto offset = static_cast<std::int32_t>(a.points.size());
  a.points.insert(a.points.end(), b.points.begin(), b.points.end());
  for (const Triangle& t : b.triangles) {
    a.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  }
  return a;
}

// A surface over the unit square as n x n cells of two triangles, which face along du x dv.
template <class Surface>
TriMesh GridMesh(const Surface& surface, int n) {
  TriMesh mesh;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      mesh.points.push_back(surface(Vec2(static_cast<double>(i) / n, static_cast<double>(j) / n)));
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const int a = i + (n + 1) * j, b = a + 1, c = a + n + 1, d = c + 1;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
  }
  return mesh;
}

// The mesh with its vertices and triangles in an order that is unrelated to their places.
inline TriMesh Shuffled(const TriMesh& mesh) {
  Random random(3);
  std::vector<std::int32_t> number(mesh.points.size());
  std::iota(number.begin(), number.end(), 0);
  for (std::size_t k = number.size(); k-- > 1;) {
    std::swap(number[k], number[random.Index(k + 1)]);
  }
  TriMesh shuffled = mesh;
  for (std::size_t v = 0; v < number.size(); ++v) {
    shuffled.points[number[v]] = mesh.points[v];
  }
  for (Triangle& t : shuffled.triangles) {
    t = {number[t[0]], number[t[1]], number[t[2]]};
  }
  std::ranges::sort(shuffled.triangles);
  return shuffled;
}

}  // namespace semblance::testing

namespace semblance::surfaces {

// The enclosed volume, mm^3; > 0 if the mesh is closed and outward. For an open mesh it depends on
// the origin.
inline double SignedVolume(const TriMesh& mesh) {
  double six_volumes = 0;
  for (const Triangle& t : mesh.triangles) {
    six_volumes += mesh.points[t[0]].dot(mesh.points[t[1]].cross(mesh.points[t[2]]));
  }
  return six_volumes / 6;
}

}  // namespace semblance::surfaces
