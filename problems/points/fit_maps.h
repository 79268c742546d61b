// SPDX-License-Identifier: GPL-3.0-or-later
// Summaries of a fit over its domain: the points' distances on a coarse mesh of the surface, in its
// cells, and against a tolerance. Each costs one pass over the points.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "fitting/plan/fit_result.h"
#include "fitting/problem/fit_schedule.h"
#include "surfaces/hspline/hspline_shape.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// Quantiles of the points' distances, outliers apart (surfaces/base/quantile.h).
struct DistanceQuantiles {
  double median_mm = kNaN, p95_mm = kNaN, max_mm = kNaN;
};
DistanceQuantiles ComputeQuantiles(const FitResult& fit);

// The surface over a grid of (u,v), with the points' distances near each vertex.
struct FitGrid {
  int columns = 0, rows = 0;         // of vertices, from (0,0) to (1,1); row by row
  Closure closure = Closure::kOpen;  // at a seam the triangles use the vertices of the first column
  TriMesh mesh;                      // mm
  std::vector<double> rms_mm;        // per vertex: of the points around it; NaN without points
};
FitGrid SampleFit(const FitResult& fit, int threads);
// The grid of every other vertex.
FitGrid Halved(const FitGrid& grid);

// A leaf of the surface's patch tree (patch_tree.h), with the points in it that are no outliers.
struct FitCell {
  int level = -1;
  double u = 0, v = 0, width = 0, height = 0;  // in the domain
  int points = 0;
  double sum_squares_mm2 = 0, largest_mm = 0;
};
std::vector<FitCell> FindFitCells(const FitResult& fit);

// The points beyond the tolerance of an adaptive fit at their (u,v), outliers apart.
struct ToleranceReport {
  double tolerance_mm = kNaN;
  int regions = 0;    // with tolerances of their own
  int points = 0;     // that are no outliers
  int beyond = 0;     // points beyond their tolerance
  int cells = 0;      // with such points
  int at_finest = 0;  // such cells on the finest level that the plan allows
  double largest_mm = 0;

  bool Met() const { return beyond == 0; }
};
ToleranceReport CompareWithTolerance(const FitResult& fit, const AdaptivePlan& plan);

// States in one sentence that the tolerance is met, or by how much and why it was missed. unit: of
// lengths, or empty.
std::string ToleranceText(const ToleranceReport& report, std::string_view unit = "");

// A length with four digits and its unit, if that is known.
std::string LengthText(double length_mm, std::string_view unit, int digits = 4);

}  // namespace semblance::problems
