// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/view/view_mesh.h"

#include <array>
#include <cmath>
#include <map>

#include "surfaces/base/error.h"
#include "surfaces/decimate/decimate.h"

namespace semblance {
namespace {

// One vertex per cell of a grid, for meshes that are no manifolds.
TriMesh Clustered(const TriMesh& mesh, double cell_mm) {
  std::map<std::array<long, 3>, std::int32_t> of_cell;
  std::vector<std::int32_t> to(mesh.points.size());
  TriMesh out;
  for (std::size_t v = 0; v < to.size(); ++v) {
    const Vec3 at = mesh.points[v] / cell_mm;
    const auto [it, is_new] =
        of_cell.try_emplace({std::lround(at.x()), std::lround(at.y()), std::lround(at.z())},
                            static_cast<std::int32_t>(out.points.size()));
    if (is_new) {
      out.points.push_back(mesh.points[v]);
    }
    to[v] = it->second;
  }
  for (const Triangle& t : mesh.triangles) {
    const Triangle s = {to[t[0]], to[t[1]], to[t[2]]};
    if (s[0] != s[1] && s[1] != s[2] && s[2] != s[0]) {
      out.triangles.push_back(s);
    }
  }
  return out;
}

}  // namespace

TriMesh ForView(const TriMesh& mesh, int most_triangles) {
  if (static_cast<int>(mesh.triangles.size()) <= most_triangles) {
    return mesh;
  }
  try {
    return Decimate(mesh, {.target_triangles = most_triangles}).mesh;
  } catch (const InputError&) {  // a scan may hold edges that no decimation takes
    return Clustered(mesh, std::sqrt(2.3 * Area(mesh) / most_triangles));
  }
}

}  // namespace semblance
