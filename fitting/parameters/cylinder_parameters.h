// SPDX-License-Identifier: GPL-3.0-or-later
// (u,v) around an axis and along it.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "fitting/parameters/map_candidate.h"
#include "fitting/parameters/parametrisation.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"

namespace semblance {

// Angle around an axis and height along it, for points that go round; u is the angle, closed.
struct CylinderParameters {
  static constexpr std::string_view kName = "cylinder";
  std::array<double, 3> axis = {0, 0, 0};  // along v; 0: found from the points
  FoldRule folds = FoldRule::kRefuse;      // of points that lie over each other
};
template <class Visitor>
void Fields(Visitor& visit, CylinderParameters& o) {
  visit(FieldInfo{.name = "axis",
                  .doc = "direction of v; [0, 0, 0] takes that principal axis of the points from "
                         "which their distances differ least, or, where they fold over its "
                         "cylinder, that over which they fold least"},
        o.axis);
  FoldField(visit, o.folds);
}

struct CylinderAxis {
  Vec3 direction, across, third, centre;
  double unevenness = kNaN;  // variance of the distances from the axis over their mean square
};

// The best cylinder of those that may be taken.
struct TriedCylinder {
  CylinderAxis axis;
  MapCandidate over;
  std::string end_fault;  // of an end at which the points close; empty if neither does
};

// Throws InputError where the points fold over every cylinder.
TriedCylinder TryCylinders(const Scan& points, const CylinderParameters& cylinder);
Parametrisation TakeCylinder(const Scan& points, const TriedCylinder& tried);

// Throws InputError where the points fold over every cylinder that may be taken, or close at an end
// of it.
Parametrisation ParametriseBy(const Scan& points, const CylinderParameters& cylinder);

}  // namespace semblance
