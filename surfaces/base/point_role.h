// SPDX-License-Identifier: GPL-3.0-or-later
// The role of a dowel (a depth marker) or of a point in a fit.
#pragma once

#include <cstdint>

#include "surfaces/base/layers.h"

namespace semblance::surfaces {

enum class PointRole : std::uint8_t {
  kScattered,  // one of many measured points, without a name
  kLandmark,   // the dowel of a site of the skull
  kInserted,   // a dowel that a user inserted between the sites (thesis 4.2)
  kSeed,       // an extra dowel, sampled from the first (implicit) face
};

}  // namespace semblance::surfaces
