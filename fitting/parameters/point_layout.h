// SPDX-License-Identifier: GPL-3.0-or-later
// Points without triangles, laid out on the plane by triangles that are made for them.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "fitting/parameters/mesh_map.h"
#include "fitting/parameters/one_to_one.h"
#include "surfaces/base/geometry.h"

namespace semblance {

struct PointLayout {
  std::vector<Vec2> at = {};     // per point, mm; none where there is a fault
  MeshMap map = MeshMap::kAuto;  // that was taken
  MapFaults faults = {};         // by the points alone
  std::size_t corners = 0;       // of the triangles
  std::size_t far_off = 0;       // points more than a few edges from the triangles
  std::string fault = {};        // why no triangles can be taken, with figures and what else to do
};

// Of the points few that lie evenly and have less noise (even_points.h) are triangulated
// (point_sheet.h) and laid out (mesh_map.h), and all points get places from these
// (sheet_places.h). The fewest points per place come first; there are more where noise is as thick
// as places are wide, where no open sheet comes of it, or where it folds. The orientation is that
// of point_sheet.h.
//   points: mm. Throws InputError for one that is not finite.
PointLayout LayOutPoints(std::span<const Vec3> points, MeshMap map);

}  // namespace semblance
