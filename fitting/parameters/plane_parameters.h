// SPDX-License-Identifier: GPL-3.0-or-later
// (u,v) on a plane.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "fitting/parameters/map_candidate.h"
#include "fitting/parameters/parametrisation.h"
#include "surfaces/base/fields.h"

namespace semblance {

// Orthogonal projection on a plane, for points that do not fold over it: on the plane of least
// squares, u along its longest direction, or, where they fold over that, on the plane across z, y
// or x over which they fold least; or on the plane across `normal`, u along the coordinate axis
// nearest to the plane (the first of equals).
struct PlaneParameters {
  static constexpr std::string_view kName = "plane";
  std::array<double, 3> normal = {0, 0, 0};  // of the heights; 0: found from the points
  FoldRule folds = FoldRule::kRefuse;        // of points that lie over each other
};
template <class Visitor>
void Fields(Visitor& visit, PlaneParameters& o) {
  visit(FieldInfo{.name = "normal",
                  .doc = "direction of the heights, such as [0, 0, 1] for a terrain; [0, 0, 0] "
                         "takes that in which the points spread least, or, where they fold over "
                         "it, z, y or x"},
        o.normal);
  FoldField(visit, o.folds);
}

// Those of least squares, across z, y and x; or that which is asked for. The best one is the last.
std::vector<MapCandidate> PlanesOver(const Scan& points, const PlaneParameters& plane);
Parametrisation TakePlane(MapCandidate plane);

// What to do with points that fold over every plane, for a message.
std::string OtherThanPlane();

// Throws InputError where the points span no plane, or fold over every one that may be taken.
Parametrisation ParametriseBy(const Scan& points, const PlaneParameters& plane);

}  // namespace semblance
