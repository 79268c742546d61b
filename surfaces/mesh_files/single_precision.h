// SPDX-License-Identifier: GPL-3.0-or-later
// Where single precision is enough for coordinates.
#pragma once

#include <cmath>
#include <limits>

namespace semblance {

// What coordinates are told apart by, whatever the mesh is of. Below 1024 mm single precision does.
inline constexpr double kCoordinateStep_mm = 1e-4;

// The step from a coordinate to the next in single precision: 3e-5 at 300, 0.5 at five million;
// infinity beyond its range.
inline double SingleStep(double coordinate) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float single = std::abs(static_cast<float>(coordinate));
  return std::isfinite(single) ? double{std::nextafter(single, kInfinity)} - single : kInfinity;
}

}  // namespace semblance
