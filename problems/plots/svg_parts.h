// SPDX-License-Identifier: GPL-3.0-or-later
// The elements that plots are made of, as SVG text.
#pragma once

#include <array>
#include <string>

namespace semblance::svg {

// Told apart by people who do not see all colours (Okabe & Ito 2008).
constexpr std::array<const char*, 7> kColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                 "#e69f00", "#56b4e9", "#444444"};

// The head of a picture, on white paper; sizes in pixels. "</svg>" ends it.
std::string Open(double height, double width = 900);

std::string Line(double x1, double y1, double x2, double y2, const char* colour, double width);

// anchor: start, middle or end.
std::string Text(double x, double y, const std::string& text, const char* anchor);

// About how wide a text stands there, generously.
double WidthOf(const std::string& text);

// A browser shows the title, unless it is empty, where the pointer rests on the dot.
std::string Dot(double x, double y, double radius, const std::string& title,
                const char* colour = "#1d2126");

// What a browser shows where the pointer rests on the element around it; nothing for no text.
std::string Title(const std::string& text);

// What fits beside a plot: each part of a label, between its commas, gets the same room, for what
// tells them apart stands at their heads.
std::string Shortened(const std::string& label);

}  // namespace semblance::svg
