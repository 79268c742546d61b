// SPDX-License-Identifier: GPL-3.0-or-later
// Dowels and network without some left-out dowels.
#pragma once

#include <cstddef>
#include <vector>

#include "interp/dowels/depth_input.h"

namespace semblance {

// Indices of dowels that are left out together.
using Folds = std::vector<std::vector<std::size_t>>;

struct ShownDowels {
  std::vector<Dowel> dowels;
  DowelNetwork network;

  // The distance from a point to the nearest dowel.
  double NearestTo_mm(const Vec3& p) const;
};

// Removes the fold's dowels from the network. If a removed dowel was inside the network, its
// neighbours are joined by new areas across the gap, as if it had never been placed. The chosen fan
// from one neighbour is the one with the largest minimum angle. At the border, or if no fan is
// sound, the dowel's areas are removed without replacement.
ShownDowels LeaveOutDowels(const DepthInput& input, const std::vector<std::size_t>& fold);

}  // namespace semblance
