// SPDX-License-Identifier: GPL-3.0-or-later
// Samples of a surface, without triangles, that a map to the plane turns over.
#pragma once

#include <vector>

#include "fitting/folds/map_samples.h"

namespace semblance::fitting {

// Shares, 0 to 1.
struct TurnedSamples {
  double turned = 0;    // samples that are turned over against the others of their piece, among the
                        // samples that have a side
  double on_sheet = 0;  // samples that lie on a sheet, among all samples
};

// Each sample on a sheet has a plane. The side of the plane is carried from neighbour to neighbour,
// first where the planes differ least (Hoppe et al. 1992). The linear map of least squares from the
// plane to the map's plane then shows whether the sample is turned over. A sample has no side where
// less than a tenth of the area is left, as on a wall seen from above; if hardly any sample has
// one, as on a sheet that is seen edge-on in its noise, a fiftieth is enough. So sheets may lie as
// close together as the neighbourhoods of the samples can separate, and as unevenly on the map as
// they like. Fewer than 32 samples with a side give none that is turned.
TurnedSamples FindTurned(const std::vector<MapSample>& samples, double period_mm);

}  // namespace semblance::fitting
