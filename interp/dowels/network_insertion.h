// SPDX-License-Identifier: GPL-3.0-or-later
// Joins a dowel that the network's plan does not name to the network (thesis 4.2: dowels inserted
// inside and outside the areas' region).
#pragma once

#include <span>

#include "interp/dowels/dowel_network.h"

namespace semblance {

enum class Insertion {
  kInside,   // the area around it became three; two on each side of an edge that it lies on
  kOutside,  // one area more, at the nearest edge of the border behind which the dowel lies
  kNone      // neither: on another dowel's base, or no edge of the border gives a sound area
};

// dowels: all, with bases and directions; depths do not matter. index: of the new dowel, which no
// area has yet. No other dowel loses or gains a depth: where its base is, its own depth holds
// before and after. Throws InputError as DowelAreas for areas that are not sound.
Insertion InsertIntoNetwork(std::span<const Dowel> dowels, int index, DowelNetwork& network);

}  // namespace semblance
