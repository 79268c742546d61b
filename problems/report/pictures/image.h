// SPDX-License-Identifier: GPL-3.0-or-later
// An 8-bit picture and its PNG file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "surfaces/base/fields.h"

namespace semblance::problems {

// sRGB-encoded, each 0..1.
struct Colour {
  double r = 0;
  double g = 0;
  double b = 0;
};

template <class Visitor>
void Fields(Visitor& visit, Colour& o) {
  visit(FieldInfo{.name = "r", .min = 0, .max = 1, .doc = "red"}, o.r);
  visit(FieldInfo{.name = "g", .min = 0, .max = 1, .doc = "green"}, o.g);
  visit(FieldInfo{.name = "b", .min = 0, .max = 1, .doc = "blue"}, o.b);
}

// Takes 0xrrggbb.
Colour HexColour(std::uint32_t rrggbb);

// Returns "#rrggbb".
std::string HexText(const Colour& colour);

struct Image {
  int width = 0;                  // pixels
  int height = 0;                 // pixels
  std::vector<std::uint8_t> rgb;  // sRGB, 3 bytes per pixel, row by row from the top left
};

// A picture of one colour. Throws InputError unless both sides are at least 1.
Image MakeImage(int width, int height, const Colour& colour);

// Mixes `colour` into a pixel by `coverage` (0..1). Does nothing outside the picture.
void BlendPixel(Image& image, int x, int y, const Colour& colour, double coverage);

// Fills columns [x, x + width) and rows [y, y + height), clipped to the picture.
void FillRectangle(Image& image, int x, int y, int width, int height, const Colour& colour);

// Copies `picture` with its top left corner to column x, row y, clipped.
void Paste(Image& onto, const Image& picture, int x, int y);

// kSmall takes a quarter of the time of libpng's default effort and gives 10 % more bytes. kQuick
// takes half the time of kSmall and gives 20 % more bytes, for flat colours up to a third more.
enum class PngEffort { kSmall, kQuick };

// A rendered picture for a page: half as wide and high, a quarter of the bytes. Its background is
// transparent, so that the page shows its own behind it, light or dark: the pixels of a row that
// have the colour of its first pixel. Throws InputError for bytes that are no PNG file of 8 bits.
std::string PagePng(const std::string& png);

// The bytes of a PNG file. The same picture gives the same bytes, because the file holds no time
// and no comment. Throws InputError for a picture without pixels.
std::string EncodePng(const Image& image, PngEffort effort = PngEffort::kSmall);

}  // namespace semblance::problems
