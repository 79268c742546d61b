// SPDX-License-Identifier: GPL-3.0-or-later
// What a dowel, or a point of a fit, stands for.
#pragma once

#include <cstdint>

namespace semblance {

enum class PointRole : std::uint8_t {
  kScattered,  // a measured point among many, without an identity of its own
  kLandmark,   // the dowel of a site of the skull
  kInserted,   // a dowel that someone inserted between the sites (thesis 4.2)
  kSeed,       // an extra dowel, taken from the implicit face
};

}  // namespace semblance
