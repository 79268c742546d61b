// SPDX-License-Identifier: GPL-3.0-or-later
// (u,v) on a sphere, of closed surfaces.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "fitting/parameters/map_candidate.h"
#include "fitting/parameters/parametrisation.h"
#include "fitting/parameters/sphere.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"

namespace semblance {

// Azimuth around an axis, closed, and angle from the pole at its foot over pi, for closed surfaces
// that every ray from the centre of the sphere nearest to the points (sphere.h) meets once. At
// either pole an edge of the domain is one place.
struct SphereParameters {
  static constexpr std::string_view kName = "sphere";
  std::array<double, 3> axis = {0, 0, 0};  // from pole to pole; 0: found from the points
  FoldRule folds = FoldRule::kRefuse;      // of points that lie over each other
};
template <class Visitor>
void Fields(Visitor& visit, SphereParameters& o) {
  visit(FieldInfo{.name = "axis",
                  .doc = "direction of v, from the pole v = 0 to the pole v = 1; [0, 0, 0] takes "
                         "that in which the points spread most, or, of flat ones, least"},
        o.axis);
  FoldField(visit, o.folds);
}

struct TriedSphere {
  PolarSphere sphere;
  std::vector<Vec2> angles;
  MapCandidate over;
  std::string fault;  // why it may not be taken; empty if it may
};

// Throws InputError for an axis that is not finite, and where no sphere goes near the points.
TriedSphere TrySphere(const Scan& points, const SphereParameters& asked);
Parametrisation TakeSphere(const Scan& points, TriedSphere tried);

// Throws InputError as TrySphere, and where the sphere may not be taken.
Parametrisation ParametriseBy(const Scan& points, const SphereParameters& asked);

}  // namespace semblance
