// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/tessellate.h"

#include <fmt/format.h>

#include "surfaces/base/error.h"

namespace semblance {

Tessellation Tessellate(const HSplineSurface& surface, int per_patch) {
  if (per_patch < 1) {
    throw InputError(
        fmt::format("tessellation: {} quads along a patch side; at least 1 is needed", per_patch));
  }
  const HSplineShape& shape = surface.shape();
  const int quads_u = per_patch * shape.PatchesU(shape.max_level),
            quads_v = per_patch * shape.PatchesV(shape.max_level);
  const int columns = quads_u + (shape.ClosedU() ? 0 : 1), rows = quads_v + 1;
  Tessellation result;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const Vec2 uv(double(i) / quads_u, double(j) / quads_v);
      const SurfaceFrame frame = surface.Frame(uv);
      result.uv.push_back(uv);
      result.mesh.points.push_back(frame.point);
      result.normals.push_back(frame.Normal());
    }
  }
  for (int j = 0; j < quads_v; ++j) {
    for (int i = 0; i < quads_u; ++i) {
      const int i1 = (i + 1) % columns;
      const int a = i + columns * j, b = i1 + columns * j, c = a + columns, d = b + columns;
      result.mesh.triangles.push_back({a, b, d});
      result.mesh.triangles.push_back({a, d, c});
    }
  }
  return result;
}

}  // namespace semblance
