// SPDX-License-Identifier: GPL-3.0-or-later
// The check that a map of scattered points to the plane is one-to-one, so that it can carry a
// surface.
#pragma once

#include <span>

#include "fitting/folds/map_samples.h"
#include "surfaces/base/geometry.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::fitting {

// Shares of the surface, 0 to 1.
struct MapFaults {
  double folded = 0;      // another sheet of the surface lies at the same place of the plane
  double collapsed = 0;   // less than 1/40 of the area is left, as of walls seen from above
  bool mirrored = false;  // most triangles run clockwise on the plane; false without triangles

  double Sum() const { return folded + collapsed; }
};

// Estimates the faults from the points alone, by some hundred samples of them and by means of
// points in small cubes, in which noise is smaller. A sample is folded in two cases:
// - The 16 samples that the map puts closest to it fall into several sheets, at least three times
// the
//   samples' spacing apart in space, and the map mixes these sheets. Two sheets on two sides of a
//   line are a cliff and no fold; noise and outliers are no sheets.
// - The map turns the sample over against its neighbours (turned_samples.h).
// With more than 2000 points only the means decide which samples collapse, because the points of
// one scan line look like a wall in their own noise. Fewer than 32 points give no faults.
MapFaults FaultsOfPoints(const PlaneMap& map);

// Computes the faults from the triangles between the points, as shares of their area: a triangle is
// folded if the map turns it over against the majority. The shares are exact, except that two
// sheets of one orientation at the same place are not found.
MapFaults FaultsOfTriangles(const PlaneMap& map, std::span<const Triangle> triangles);

// The same, but each point is judged by the two rings of triangles around it together, because
// noise turns single triangles over and their neighbours make up for it. It is too coarse for
// narrow folds: near the edge of a fold it finds about half of the area.
MapFaults FaultsBeyondNoise(const PlaneMap& map, std::span<const Triangle> triangles);

// The first case of FaultsOfPoints alone: the share of samples at whose place the map mixes several
// sheets. The positions are scaled to the same spread along each of their principal axes, so that
// their units have no effect. It suits maps with errors, which turn samples over by chance.
double MixedShare(const PlaneMap& map);

// Compares neighbours on the map with any points: the variance of 17 neighbours around their plane
// over (u,v), over the variance of 17 points from everywhere around their mean; the ratio of the
// medians of both over some hundred samples. It is 1 for places that have nothing to do with the
// positions, and small for a surface. Returns 0 for fewer than 18 points or points at one place.
double NeighbourScatter(const PlaneMap& map);

// The same for heights that may have many outliers, as a measure along x alone: the squared length
// of the shortest range that holds eleven of 17 heights, of neighbours over that of points from
// everywhere. Up to a third of outliers has no effect, on one side or on both; half of the heights
// on each of two sheets give about 1.
double ScatterOfMostHeights(const PlaneMap& map);

}  // namespace semblance::fitting
