// SPDX-License-Identifier: GPL-3.0-or-later
// Fewer points, evenly spread and with less noise, in place of many that lie about a surface.
#pragma once

#include <span>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

struct EvenPoints {
  std::vector<Vec3> positions;      // mm
  std::vector<double> spacings_mm;  // of each from the next: about one to two of these
  double thickness = kNaN;          // median over them: how thick the points lie about the
                                    // surface, over how wide the neighbourhood is that was looked
                                    // at. About 0 of a thin sheet, 1 of a ball
};

// A point is kept unless one that was kept has it among its `per_place` nearest. Those that have
// much more room than their neighbours are outliers, and left out. Each that is kept goes onto the
// plane of least squares of its neighbourhood, 4 per_place points, some times (Pauly et al. 2002);
// of those that come too close to each other there, one is kept. The result does not depend on the
// order of the points. Of more than 200,000 an even part alone is looked at.
//   points: mm, finite; per_place: at least 1.
EvenPoints EvenlySpread(std::span<const Vec3> points, int per_place);

}  // namespace semblance
