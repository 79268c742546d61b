// SPDX-License-Identifier: GPL-3.0-or-later
// The poles of a closed surface that goes round in u: where v is 0 or 1 a whole edge of the domain
// is to be one place.
#pragma once

#include <array>

#include "surfaces/hspline_query/tessellate.h"

namespace semblance {

struct PoleGap {
  Vec3 place = Vec3::Constant(kNaN);  // mean of the edge, mm
  double gap_mm = kNaN;               // how far the edge goes from it at most
};
using PoleGaps = std::array<PoleGap, 2>;  // at v = 0 and v = 1
PoleGaps PoleGapsOf(const HSplineSurface& surface);

// Whether the surface goes round in u alone, and both its edges are narrower than a twentieth of
// the widest of three rings between them. Of points over a cylinder that close at its ends, edges
// are wider; of noisy ones over a sphere they may be so too.
bool ClosesAtPoles(const HSplineSurface& surface, const PoleGaps& gaps);

// Each edge becomes one vertex at its mean (JoinEdge): watertight.
void JoinPoles(const PoleGaps& gaps, Tessellation& tessellation);

}  // namespace semblance
