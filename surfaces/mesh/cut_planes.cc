// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/cut_planes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace semblance::surfaces {
namespace {

double LengthAlong(const CutPlane& plane, const TriMesh& mesh,
                   const std::vector<MeshEdge>& border) {
  constexpr double kNear_mm = 1;
  double length = 0;
  for (const auto& [a, b] : border) {
    const Vec3 &p = mesh.points[a], &q = mesh.points[b];
    if (std::abs(plane.Beyond_mm(p)) <= kNear_mm && std::abs(plane.Beyond_mm(q)) <= kNear_mm) {
      length += (p - q).norm();
    }
  }
  return length;
}

double LidArea_mm2(const CutPlane& plane, const TriMesh& mesh) {
  constexpr double kNear_mm = 0.5, kLeastCosine = 0.985;  // 10 degrees
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    const bool near = std::ranges::all_of(
        t, [&](auto v) { return plane.Beyond_mm(mesh.points[v]) >= -kNear_mm; });
    if (near) {
      const Vec3 facing = TriangleAreaVector(mesh, t);
      area += plane.sign * facing[plane.axis] >= kLeastCosine * facing.norm() ? facing.norm() : 0;
    }
  }
  return area;
}

// Returns those of the six sides of the bounding box that `accept` accepts.
template <class Accept>
std::vector<CutPlane> SidesWhere(const TriMesh& mesh, const Accept& accept) {
  const Box3 box = Bounds(mesh);
  std::vector<CutPlane> planes;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int sign : {-1, 1}) {
      const CutPlane plane{axis, sign, sign < 0 ? box.min()[axis] : box.max()[axis]};
      if (accept(plane)) {
        planes.push_back(plane);
      }
    }
  }
  return planes;
}

}  // namespace

std::vector<CutPlane> FindCutPlanes(const TriMesh& skull) {
  constexpr double kLeastBorder_mm = 100;
  const std::vector<MeshEdge> border = BorderEdges(skull);
  return SidesWhere(skull, [&](const CutPlane& plane) {
    return LengthAlong(plane, skull, border) >= kLeastBorder_mm;
  });
}

std::vector<CutPlane> FindLids(const TriMesh& mesh) {
  constexpr double kLeastLid_mm2 = 500;
  return SidesWhere(
      mesh, [&](const CutPlane& plane) { return LidArea_mm2(plane, mesh) >= kLeastLid_mm2; });
}

std::string ToPhrase(const CutPlane& plane) {
  constexpr std::array<std::array<const char*, 2>, 3> kEnds = {
      {{"right", "left"}, {"front", "back"}, {"lower", "upper"}}};
  return fmt::format("{} = {:.1f} mm ({} end)", "xyz"[plane.axis], plane.at_mm,
                     kEnds[plane.axis][plane.sign > 0]);
}

TriMesh WithinScan(const TriMesh& face, std::span<const CutPlane> planes, double margin_mm) {
  if (planes.empty()) {
    return face;
  }
  std::vector<bool> keep;
  for (const Triangle& t : face.triangles) {
    const Vec3 centroid = TriangleCentroid(face, t);
    keep.push_back(std::all_of(planes.begin(), planes.end(), [&](const CutPlane& plane) {
      return plane.Beyond_mm(centroid) <= -margin_mm;
    }));
  }
  return Submesh(face, keep);
}

}  // namespace semblance::surfaces
