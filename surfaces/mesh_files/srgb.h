// SPDX-License-Identifier: GPL-3.0-or-later
// The transfer curve of sRGB (IEC 61966-2-1). Files contain the encoded value; arithmetic with
// light needs the linear one.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "surfaces/base/layers.h"

namespace semblance::surfaces {

inline double LinearFromSrgb(double v) {
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

// Clamped to 0..1.
inline double SrgbFromLinear(double v) {
  v = std::clamp(v, 0.0, 1.0);
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}

// SrgbFromLinear as a byte, from a table. The byte is off by at most 0.53 of a step.
inline std::uint8_t SrgbByte(float linear) {
  constexpr int kEntries = 1 << 16;
  static const std::vector<std::uint8_t> kTable = [] {
    std::vector<std::uint8_t> table(kEntries);
    for (int i = 0; i < kEntries; ++i) {
      table[i] = static_cast<std::uint8_t>(255 * SrgbFromLinear(i / (kEntries - 1.0)) + 0.5);
    }
    return table;
  }();
  return kTable[static_cast<int>(std::clamp(linear, 0.0F, 1.0F) * (kEntries - 1) + 0.5F)];
}

}  // namespace semblance::surfaces
