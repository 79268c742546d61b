// SPDX-License-Identifier: GPL-3.0-or-later
// What is left of dowels and network when some dowels are left out.
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

  // The distance from a point to the nearest of them.
  double NearestTo_mm(const Vec3& p) const;
};

// The network without the fold's dowels. Where a left-out dowel stood inside the network, its
// neighbours get areas of their own across the gap, as if it had never been placed: the fan from
// one of them whose least angle is largest. At the border its areas are gone, and so they are
// where no fan is sound.
ShownDowels Without(const DepthInput& input, const std::vector<std::size_t>& fold);

}  // namespace semblance
