// SPDX-License-Identifier: GPL-3.0-or-later
// From millimetres to colours, and the legend that says which is which.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "problems/pictures/image.h"

namespace semblance {

// Values between low_mm and high_mm spread over evenly spaced control colours, interpolated in
// OKLab (Ottosson 2020), where equal steps look equal. Values beyond the ends take the end's
// colour.
struct ColourMap {
  std::vector<Colour> colours;  // at least 2, first at low_mm, last at high_mm
  double low_mm = 0;
  double high_mm = 1;
};

inline constexpr Colour kNoDataColour = {0.56, 0.56, 0.56};

// Dark violet over blue and green to yellow; luminance rises all the way, so it survives a grey
// print. Throws InputError unless low_mm < high_mm, both finite.
ColourMap SequentialMap(double low_mm, double high_mm);

// Blue (-range_mm) over white (0) to red (+range_mm). Throws InputError unless range_mm is positive
// and finite.
ColourMap DivergingMap(double range_mm);

// kNoDataColour for NaN.
Colour ColourAt(const ColourMap& map, double value_mm);
std::vector<Colour> ColoursAt(const ColourMap& map, std::span<const double> values_mm);

// Round numbers from low_mm to high_mm, about `wanted` of them (1, 2 or 5 times a power of ten
// apart).
std::vector<double> Ticks(const ColourMap& map, int wanted);

struct Legend {
  ColourMap map;
  std::string title;          // what is shown; " (mm)" is added
  bool shows_no_data = true;  // with a swatch for "no data"
};

// A horizontal colour bar with ticks, centred in columns [x, x + width), rows [y, y + height).
// The lettering grows with the height; 84 gives small print.
void DrawLegend(Image& image, const Legend& legend, int x, int y, int width, int height);

}  // namespace semblance
