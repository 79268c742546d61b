// SPDX-License-Identifier: GPL-3.0-or-later
// How far the triangles around an edge move when it collapses to a point.
#pragma once

#include <vector>

#include "surfaces/decimate/patch_places.h"

namespace semblance {

struct PatchMove {
  // No point of either sheet, before and after, lies further from the other: the largest difference
  // of height over a common plane, which is where an edge ends or crosses one of the other sheet
  // (Cohen, Manocha & Olano 1997); where they are no height fields, how far the ends move.
  double sheets_mm = kNaN;
  std::vector<int> under;           // which new triangle each sample belongs to
  std::vector<double> distance_mm;  // and no further than this it is from it
};

void MeasureMove(const PatchPlaces& patch, PatchMove& move);

}  // namespace semblance
