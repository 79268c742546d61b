// SPDX-License-Identifier: GPL-3.0-or-later
// Reads single pixels of a picture.
#pragma once

#include <cstddef>
#include <cstdint>

#include "problems/report/pictures/image.h"

namespace semblance::testing {
using namespace problems;

// The pixel at column x and row y, which must be inside.
inline Colour PixelAt(const Image& image, int x, int y) {
  const std::uint8_t* const pixel =
      &image.rgb.at(3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                         static_cast<std::size_t>(x)));
  return {pixel[0] / 255.0, pixel[1] / 255.0, pixel[2] / 255.0};
}

}  // namespace semblance::testing
