// SPDX-License-Identifier: GPL-3.0-or-later
// The transfer curve of sRGB (IEC 61966-2-1). Light adds up linearly; files hold the encoded value.
#pragma once

#include <algorithm>
#include <cmath>

namespace semblance {

inline double LinearFromSrgb(double v) {
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

// Clamped to 0..1.
inline double SrgbFromLinear(double v) {
  v = std::clamp(v, 0.0, 1.0);
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}

}  // namespace semblance
