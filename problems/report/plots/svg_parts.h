// SPDX-License-Identifier: GPL-3.0-or-later
// The elements of plots as SVG text, and the escaping of text inside HTML, SVG and XML.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

namespace semblance::problems {

// & < > " ' become entities. A control character that HTML forbids becomes a replacement character.
std::string EscapeHtml(std::string_view text);

namespace svg {

// Colours that colour-blind people can distinguish (Okabe & Ito 2008).
constexpr std::array<const char*, 7> kColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                 "#e69f00", "#56b4e9", "#444444"};

// The start of a picture on white paper, sizes in pixels. The caller appends "</svg>".
std::string Open(double height, double width = 900);

std::string Line(double x1, double y1, double x2, double y2, const char* colour, double width);

// anchor: start, middle or end.
std::string Text(double x, double y, const std::string& text, const char* anchor);

// A generous estimate of the width of a text in pixels.
double TextWidth(const std::string& text);

// A browser shows the title, unless it is empty, when the pointer rests on the dot.
std::string Dot(double x, double y, double radius, const std::string& title,
                const char* colour = "#1d2126");

// The text that a browser shows when the pointer rests on the enclosing element. Empty for no text.
std::string Title(const std::string& text);

// Shortens a text to `most` bytes and an ellipsis, without cutting a UTF-8 character in half.
std::string CutTo(const std::string& text, std::size_t most);

// Shortens a label so that it fits beside a plot. Each part between commas gets the same room,
// because labels differ at the heads of their parts.
std::string Shortened(const std::string& label);

}  // namespace svg
}  // namespace semblance::problems
