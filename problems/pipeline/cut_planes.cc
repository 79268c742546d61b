// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pipeline/cut_planes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace semblance {
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

}  // namespace

std::vector<CutPlane> FindCutPlanes(const TriMesh& skull) {
  constexpr double kLeastBorder_mm = 100;
  const std::vector<MeshEdge> border = BorderEdges(skull);
  const Box3 box = Bounds(skull);
  std::vector<CutPlane> planes;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int sign : {-1, 1}) {
      const CutPlane plane{axis, sign, sign < 0 ? box.min()[axis] : box.max()[axis]};
      if (LengthAlong(plane, skull, border) >= kLeastBorder_mm) {
        planes.push_back(plane);
      }
    }
  }
  return planes;
}

std::string InWords(const CutPlane& plane) {
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

}  // namespace semblance
