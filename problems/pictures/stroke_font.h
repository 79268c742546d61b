// SPDX-License-Identifier: GPL-3.0-or-later
// Text in pictures: a small stroke font, smooth at every size, that needs no font file.
#pragma once

#include <string_view>

#include "problems/pictures/image.h"

namespace semblance {

enum class Anchor { kLeft, kCentre, kRight };

struct TextStyle {
  double cap_height_px = 12;  // of a capital letter, > 0; small letters hang 0.3 of it below
  double stroke = 0.11;       // width of the pen, in cap heights; 0.16 looks bold
  Colour colour = {0.13, 0.14, 0.16};
  Anchor anchor = Anchor::kLeft;  // what of the text x means
};

// Width of the inked text in pixels. Text is UTF-8: ASCII and the signs used in captions
// (plus-minus, degree, dash, times, square); any other character is drawn as a box.
double TextWidth(std::string_view text, const TextStyle& style);

// Draws one line of text with its baseline at row `baseline_y`, clipped to the picture.
void DrawText(Image& image, double x, double baseline_y, std::string_view text,
              const TextStyle& style);

}  // namespace semblance
