// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit looks like: the surface as a coarse mesh, the points' distances over it, and its
// cells. All of it costs one pass over the points.
#pragma once

#include <string>
#include <vector>

#include "fitting/plan/fit_result.h"
#include "fitting/problem/fit_schedule.h"
#include "surfaces/hspline/hspline_shape.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Of the points' distances, outliers too (surfaces/base/quantile.h).
struct DistanceQuantiles {
  double median_mm = kNaN, p95_mm = kNaN, max_mm = kNaN;
};
DistanceQuantiles QuantilesOf(const FitResult& fit);

// The surface over a grid of (u,v), with the points' distances near each vertex.
struct FitGrid {
  int columns = 0, rows = 0;         // of vertices, from (0,0) to (1,1); row by row
  Closure closure = Closure::kOpen;  // triangles meet across a seam in its first vertices
  TriMesh mesh;                      // mm
  std::vector<double> rms_mm;        // of the points around the vertex; NaN: none
};
FitGrid GridOf(const FitResult& fit, int threads);
// Every other vertex.
FitGrid Halved(const FitGrid& grid);

// A leaf of the surface's patch tree (patch_tree.h), and the points in it.
struct FitCell {
  int level = -1;
  double u = 0, v = 0, width = 0, height = 0;  // of the domain
  int points = 0;                              // outliers apart
  double sum_squares_mm2 = 0, largest_mm = 0;
};
std::vector<FitCell> CellsOf(const FitResult& fit);

// Which points are farther off than the tolerance of an adaptive fit where they are; outliers
// apart.
struct ToleranceReport {
  double tolerance_mm = kNaN;
  int regions = 0;    // with tolerances of their own
  int points = 0;     // all that count
  int beyond = 0;     // of them, farther off
  int cells = 0;      // in which those lie
  int at_finest = 0;  // of these cells, on the finest level that was allowed
  double largest_mm = 0;

  bool Met() const { return beyond == 0; }
};
ToleranceReport ToleranceOf(const FitResult& fit, const AdaptivePlan& plan);

// "the tolerance of 0.5 mm is met by all 1000 points", or by how much it was missed, and why.
std::string ToleranceText(const ToleranceReport& report);

}  // namespace semblance
