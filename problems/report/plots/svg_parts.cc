// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/plots/svg_parts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "problems/config/utf8_check.h"

namespace semblance::problems {
std::string EscapeHtml(std::string_view text) {
  std::string html;
  for (const Character& c : SplitCharacters(text)) {
    switch (c.code) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      case '\'':
        html += "&#39;";
        break;
      case '\t':
      case '\n':
        html += c.bytes;
        break;
      case '\r':
        break;
      default:
        html += ControlsText(c.code) ? "\uFFFD" : c.bytes;
    }
  }
  return html;
}

namespace svg {

std::string Open(double height, double width) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "width=\"{0:.0f}\" height=\"{1:.0f}\" font-family=\"system-ui, sans-serif\" "
      "font-size=\"14\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
      width, height);
}

std::string Line(double x1, double y1, double x2, double y2, const char* colour, double width) {
  return fmt::format(
      "<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\" stroke=\"{}\" "
      "stroke-width=\"{}\"/>\n",
      x1, y1, x2, y2, colour, width);
}

std::string Text(double x, double y, const std::string& text, const char* anchor) {
  return fmt::format(
      "<text x=\"{:.2f}\" y=\"{:.2f}\" text-anchor=\"{}\" fill=\"#1d2126\">{}</text>\n", x, y,
      anchor, EscapeHtml(text));
}

double TextWidth(const std::string& text) { return 7.5 * static_cast<double>(text.size()); }

std::string Dot(double x, double y, double radius, const std::string& title, const char* colour) {
  return fmt::format(
      "<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{}\" fill=\"{}\" "
      "fill-opacity=\"0.55\">{}</circle>\n",
      x, y, radius, colour, Title(title));
}

std::string Title(const std::string& text) {
  return text.empty() ? "" : fmt::format("<title>{}</title>", EscapeHtml(text));
}

std::string CutTo(const std::string& text, std::size_t most) {
  if (text.size() <= most) {
    return text;
  }
  while (most > 0 && (static_cast<unsigned char>(text[most]) & 0xC0) == 0x80) {
    --most;
  }
  return text.substr(0, most) + "…";
}

std::string Shortened(const std::string& label) {
  constexpr std::size_t kLongest = 40;  // characters that fit beside a plot
  if (label.size() <= kLongest) {
    return label;
  }
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= label.size();) {
    const std::size_t end = std::min(label.find(", ", begin), label.size());
    parts.push_back(label.substr(begin, end - begin));
    begin = end + 2;
  }
  for (std::string& part : parts) {
    part = CutTo(part, std::max<std::size_t>(kLongest / parts.size(), 5) - 2);
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace svg
}  // namespace semblance::problems
