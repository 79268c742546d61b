// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/mesh_primitives.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "surfaces/base/error.h"

namespace semblance::surfaces {
namespace {

Vec3 OnCircle(const Vec3& u, const Vec3& v, int i, int count) {
  const double phi = 2 * std::numbers::pi * i / count;
  return std::cos(phi) * u + std::sin(phi) * v;
}

}  // namespace

TriMesh MakeCylinder(const Vec3& from, const Vec3& to, double radius_mm, int sides) {
  const double length = (to - from).norm();
  if (sides < 3 || !(radius_mm > 0) || !(length > 0)) {
    throw InputError(fmt::format(
        "cylinder of {} sides, radius {} mm, length {} mm: needs 3 sides or more, and both lengths "
        "positive",
        sides, radius_mm, length));
  }
  const Vec3 axis = (to - from) / length;
  const Vec3 u = axis.unitOrthogonal(), v = axis.cross(u);
  TriMesh mesh;
  // Rim points are doubled, so that smooth shading keeps a crease between wall and caps.
  for (const Vec3& end : {from, to, from, to}) {
    for (int i = 0; i < sides; ++i) {
      mesh.points.push_back(end + radius_mm * OnCircle(u, v, i, sides));
    }
  }
  mesh.points.insert(mesh.points.end(), {from, to});
  for (int i = 0; i < sides; ++i) {
    const int j = (i + 1) % sides, cap = 2 * sides, centre = 4 * sides;
    mesh.triangles.push_back({i, j, sides + j});
    mesh.triangles.push_back({i, sides + j, sides + i});
    mesh.triangles.push_back({centre, cap + j, cap + i});
    mesh.triangles.push_back({centre + 1, cap + sides + i, cap + sides + j});
  }
  return mesh;
}

TriMesh MakeSphere(const Vec3& center, double radius_mm, int rings) {
  if (rings < 2 || !(radius_mm > 0)) {
    throw InputError(
        fmt::format("sphere of {} rings, radius {} mm: needs 2 rings or more and a positive radius",
                    rings, radius_mm));
  }
  const int columns = 2 * rings;
  TriMesh mesh;
  mesh.points.push_back(center + Vec3(0, 0, radius_mm));
  for (int r = 1; r < rings; ++r) {
    const double theta = std::numbers::pi * r / rings;
    for (int c = 0; c < columns; ++c) {
      const Vec3 flat = OnCircle({1, 0, 0}, {0, 1, 0}, c, columns);
      mesh.points.push_back(center +
                            radius_mm * (std::sin(theta) * flat + Vec3(0, 0, std::cos(theta))));
    }
  }
  mesh.points.push_back(center - Vec3(0, 0, radius_mm));
  const int south = static_cast<int>(mesh.points.size()) - 1;
  for (int c = 0; c < columns; ++c) {
    const auto at = [&](int ring, int column) { return 1 + ring * columns + column % columns; };
    mesh.triangles.push_back({0, at(0, c), at(0, c + 1)});
    for (int r = 0; r + 2 < rings; ++r) {
      mesh.triangles.push_back({at(r, c), at(r + 1, c), at(r + 1, c + 1)});
      mesh.triangles.push_back({at(r, c), at(r + 1, c + 1), at(r, c + 1)});
    }
    mesh.triangles.push_back({south, at(rings - 2, c + 1), at(rings - 2, c)});
  }
  return mesh;
}

void Append(TriMesh& mesh, const TriMesh& part) {
  const auto base = static_cast<std::int32_t>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), part.points.begin(), part.points.end());
  for (const Triangle& t : part.triangles) {
    mesh.triangles.push_back({base + t[0], base + t[1], base + t[2]});
  }
}

}  // namespace semblance::surfaces
