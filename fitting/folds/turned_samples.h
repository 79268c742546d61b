// SPDX-License-Identifier: GPL-3.0-or-later
// Where a map turns a surface over, told by samples of it without triangles.
#pragma once

#include <vector>

#include "fitting/folds/map_samples.h"

namespace semblance {

// Shares, 0 to 1.
struct TurnedSamples {
  double turned = 0;    // of the samples with a side: over against the others of their piece
  double on_sheet = 0;  // of all samples: those that lie on a sheet
};

// A sample that lies on a sheet has a plane, and the side of that is carried from neighbour to
// neighbour, where their planes differ least first (Hoppe et al. 1992). The map near a sample is
// the linear one of least squares from its plane; where less than a tenth of the area is left, as
// on a wall seen from above, it has no side; where hardly any has one, as of a sheet seen edge-on
// in its noise, a fiftieth does. Sheets may lie as close together as the samples' neighbourhoods
// tell apart, and as unevenly on the map as they like. Of fewer than 32 samples with a side none is
// turned.
TurnedSamples FindTurned(const std::vector<MapSample>& samples, const Vec2& period_mm);

}  // namespace semblance
