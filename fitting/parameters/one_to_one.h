// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a map of scattered points to the plane can carry a surface: one place of the surface for
// each place of the plane.
#pragma once

#include <span>

#include "fitting/folds/plane_map.h"
#include "surfaces/base/geometry.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Shares of the surface, 0 to 1.
struct MapFaults {
  double folded = 0;      // another sheet of the surface lies at the same place of the plane
  double collapsed = 0;   // less than a fortieth of its area is left, as of walls seen from above
  bool mirrored = false;  // most triangles run clockwise on the plane; false without triangles

  double Sum() const { return folded + collapsed; }
};

// From the points alone, as they are and as means over small cubes: each of some hundred samples
// looks at the 16 others that the map brings closest. It is folded where these fall into several
// sheets, three times the samples' spacing apart in space or more, that the map mixes; two on two
// sides of a line are a cliff. Noise and outliers are no sheets. Of more than 2000 points the means
// alone tell what has collapsed, for points of a scanner's line stand like a wall in their noise.
// Samples that the map turns over against those beside them (turned_samples.h) are folded too. Of
// fewer than 32 points nothing is said.
MapFaults FaultsOfPoints(const PlaneMap& map);

// The same by the triangles over the points, as shares of their area: folded are those that the map
// turns over against the others. Exact, but for places that two sheets with one orientation share.
MapFaults FaultsOfTriangles(const PlaneMap& map, std::span<const Triangle> triangles);

// The same, each point judged by two rings of triangles around it together: noise turns triangles,
// and those beside them make up for it. So few points tell what folds there, and near a fold half
// of it.
MapFaults FaultsBeyondNoise(const PlaneMap& map, std::span<const Triangle> triangles);

}  // namespace semblance
