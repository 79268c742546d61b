// SPDX-License-Identifier: GPL-3.0-or-later
// Offsets that all points of a run of the file share, as the lines of a scanner or a survey that
// drifts from line to line. Points on a line agree with each other, so a fit to the points would
// follow each line.
#pragma once

#include <optional>
#include <vector>

#include "fitting/nested/error_structure.h"
#include "fitting/nested/nested_points.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

struct RunOffsets {
  FileRuns runs;
  std::vector<double> offset_mm;  // per run, along the points' only channel
  double sd_mm = kNaN;            // standard deviation of the offsets
  // Mean square, over the points, of the part of the offsets that the surface still follows, mm^2.
  double left_square = kNaN;

  double At(std::size_t k) const {
    return runs.run[k] == FileRuns::kNone ? 0 : offset_mm[runs.run[k]];
  }
};

// Finds the offsets of runs from a surface that is as smooth as predicts runs best that it was not
// fitted to. Cross-validation by single points cannot do this, since each point has neighbours with
// its own error. Returns nothing without runs, for points in more than one channel or with
// weights, where most of what a run's parts lie off the surface is not common to the run, and where
// runs predict each other: that is detail of the surface.
//   start: the surface from which the points are displaced.
std::optional<RunOffsets> FindRunOffsets(const NestedPoints& points, const HSplineSurface& start);

// Subtracts the offsets from the points' displacements.
void Level(const RunOffsets& offsets, NestedPoints& points);

}  // namespace semblance::fitting
