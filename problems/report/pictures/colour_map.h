// SPDX-License-Identifier: GPL-3.0-or-later
// Colours for values in millimetres.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "problems/report/pictures/image.h"

namespace semblance::problems {

// Values between low_mm and high_mm spread over evenly spaced control colours, interpolated in
// OKLab (Ottosson 2020), where equal steps look equal. Values beyond the ends take the end's
// colour.
struct ColourMap {
  std::vector<Colour> colours;  // at least 2, first at low_mm, last at high_mm
  double low_mm = 0;
  double high_mm = 1;
};

inline constexpr Colour kNoDataColour = {0.56, 0.56, 0.56};

// Dark violet over blue and green to yellow. Luminance rises all the way, so the map survives a
// grey print. Throws InputError unless low_mm < high_mm, both finite.
ColourMap SequentialMap(double low_mm, double high_mm);

// Blue (-range_mm) over white (0) to red (+range_mm). Throws InputError unless range_mm is positive
// and finite.
ColourMap DivergingMap(double range_mm);

// Returns kNoDataColour for NaN.
Colour ColourAt(const ColourMap& map, double value_mm);
std::vector<Colour> ColoursAt(const ColourMap& map, std::span<const double> values_mm);

// Evenly spaced colours from low_mm to high_mm as "#rrggbb", for pages that interpolate linearly
// between them. There are 33, which are close enough for straight lines.
std::vector<std::string> ColourSteps(const ColourMap& map);

// The key to a picture whose colours stand for numbers. Reports draw it below the picture.
struct Legend {
  ColourMap map;
  std::string title;          // the quantity shown, without its unit
  std::string unit = "mm";    // empty if it is not known
  bool shows_no_data = true;  // adds a swatch for "no data"
};

}  // namespace semblance::problems
