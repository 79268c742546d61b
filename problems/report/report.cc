// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>

#include "problems/output/files.h"
#include "problems/report/report_assets.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

std::string MimeType(const ReportImage& image) {
  const std::string_view bytes = image.bytes;
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) {
    return "image/png";
  }
  if (bytes.substr(0, 1024).find("<svg") != std::string_view::npos) {
    return "image/svg+xml";
  }
  throw InputError(fmt::format(
      "report image '{}' ({} bytes): neither PNG nor SVG; give the bytes of such a file",
      image.caption.empty() ? image.alt : image.caption, bytes.size()));
}

// " width=.. height=.." of a PNG, so that a page does not jump while it loads; empty for others.
std::string SizeAttributes(const std::string& bytes) {
  if (!bytes.starts_with('\x89') || bytes.size() < 24) {
    return {};
  }
  const auto number = [&](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = at; i < at + 4; ++i) {
      value = (value << 8) | static_cast<unsigned char>(bytes[i]);
    }
    return value;
  };
  const std::uint32_t width = number(16), height = number(20);
  return fmt::format(" width=\"{}\" height=\"{}\"{}", width, height,
                     width > 1.8 * height ? " class=\"wide\"" : "");
}

std::string ImageHtml(const ReportImage& image) {
  if (image.alt.empty()) {
    throw InputError(fmt::format(
        "report image '{}': it has no alt text; say in a few words what it shows", image.caption));
  }
  std::string html = fmt::format(
      "<figure><div class=\"scroll\"><img alt=\"{}\"{} src=\"data:{};base64,{}\"></div>",
      EscapeHtml(image.alt), SizeAttributes(image.bytes), MimeType(image), Base64(image.bytes));
  if (!image.caption.empty()) {
    html += fmt::format("<figcaption>{}</figcaption>", EscapeHtml(image.caption));
  }
  return html + "</figure>\n";
}

// A number with an optional sign, unit or spread: "1.84", "-3 mm", "1.2 ± 0.4", "12 %".
bool IsNumeric(const std::string& cell) {
  std::size_t i = 0;
  for (const std::string_view sign : {"+", "-", "\u2212", "\u00b1", "<", ">"}) {
    i = std::string_view(cell).starts_with(sign) ? sign.size() : i;
  }
  const bool starts_with_digit =
      i < cell.size() && std::isdigit(static_cast<unsigned char>(cell[i]));
  return (starts_with_digit && cell.size() <= 24) || cell == "NaN" || cell == "inf";
}

// Columns whose cells, where there are any, are all numbers.
std::vector<bool> NumericColumns(const ReportTable& table) {
  std::vector<bool> numeric(table.header.size(), false);
  for (std::size_t c = 0; c < numeric.size(); ++c) {
    bool has_number = false, has_text = false;
    for (const auto& row : table.rows) {
      has_number |= IsNumeric(row[c]);
      has_text |= !row[c].empty() && row[c] != "-" && row[c] != "\u2013" && !IsNumeric(row[c]);
    }
    numeric[c] = has_number && !has_text;
  }
  return numeric;
}

void CheckTable(const ReportTable& table) {
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    if (table.rows[r].size() != table.header.size()) {
      throw InputError(fmt::format("report table '{}': row {} has {} cells for {} columns",
                                   table.caption, r, table.rows[r].size(), table.header.size()));
    }
  }
}

std::string RowHtml(const std::vector<std::string>& cells, const std::vector<bool>& numeric,
                    std::string_view tag) {
  std::string html = "<tr>";
  for (std::size_t c = 0; c < cells.size(); ++c) {
    html += fmt::format("<{0}{1}{2}>{3}</{0}>", tag, tag == "th" ? " scope=\"col\"" : "",
                        numeric[c] ? " class=\"n\"" : "",
                        cells[c].empty() ? "\u2013" : EscapeHtml(cells[c]));
  }
  return html + "</tr>\n";
}

std::string TableHtml(const ReportTable& table) {
  CheckTable(table);
  const std::vector<bool> numeric = NumericColumns(table);
  std::string html = "<div class=\"scroll\" tabindex=\"0\"><table>\n";
  if (!table.caption.empty()) {
    html += fmt::format("<caption>{}</caption>\n", EscapeHtml(table.caption));
  }
  html += "<thead>" + RowHtml(table.header, numeric, "th") + "</thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    html += RowHtml(row, numeric, "td");
  }
  return html + "</tbody></table></div>\n";
}

std::string TilesHtml(const std::vector<ReportTile>& tiles) {
  if (tiles.empty()) {
    return {};
  }
  std::string html = "<dl class=\"tiles\">\n";
  for (const ReportTile& tile : tiles) {
    html += fmt::format("<div class=\"tile\"><dt>{}</dt><dd class=\"value\">{}",
                        EscapeHtml(tile.label), EscapeHtml(tile.value));
    if (!tile.unit.empty()) {
      html += fmt::format("<span class=\"unit\">{}</span>", EscapeHtml(tile.unit));
    }
    html += "</dd>";
    if (!tile.note.empty()) {
      html += fmt::format("<dd class=\"note\">{}</dd>", EscapeHtml(tile.note));
    }
    html += "</div>\n";
  }
  return html + "</dl>\n";
}

std::string NavigationHtml(const std::vector<ReportSection>& sections) {
  if (sections.size() < 2) {
    return {};
  }
  std::string html = "<nav aria-label=\"Sections\">";
  for (std::size_t i = 0; i < sections.size(); ++i) {
    html += fmt::format("<a href=\"#s{}\">{}</a> ", i + 1, EscapeHtml(sections[i].heading));
  }
  return html + "</nav>\n";
}

// A policy that lets the page reach nothing outside itself.
constexpr std::string_view kPolicy =
    "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src "
    "'unsafe-inline'";

std::string Script(std::string_view text) { return fmt::format("<script>\n{}</script>\n", text); }

// The 3-D view, with all that it is made of. In JSON "<" can stand in strings only, where it may be
// written as \u003c, so that no "</script>" ends the block early.
std::string ViewHtml(const std::string& scenes, const std::string& note) {
  if (scenes.empty() || ThreeScript().empty()) {
    return {};
  }
  std::string safe;
  for (const char c : scenes) {
    if (c == '<') {
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  std::string html =
      "<section>\n<h2 id=\"s0\">In three dimensions</h2>\n<p>Drag to turn, shift and drag to move, "
      "wheel to zoom; point at a surface or a dowel to read its value.</p>\n"
      "<div id=\"view3d\"></div>\n<script type=\"application/json\" id=\"view3d-scenes\">";
  html += safe + "</script>\n";
  html += note.empty() ? "" : fmt::format("<p>{}</p>\n", EscapeHtml(note));
  html += "</section>\n";
  return html + Script(ThreeScript()) + Script(ReportViewScript());
}

std::string SectionHtml(const ReportSection& section, std::size_t number) {
  std::string html =
      fmt::format("<section>\n<h2 id=\"s{}\">{}</h2>\n", number, EscapeHtml(section.heading));
  for (const std::string& paragraph : section.paragraphs) {
    html += fmt::format("<p>{}</p>\n", EscapeHtml(paragraph));
  }
  for (const ReportImage& image : section.images) {
    html += ImageHtml(image);
  }
  for (const ReportTable& table : section.tables) {
    html += TableHtml(table);
  }
  if (!section.preformatted.empty()) {
    html += fmt::format("<pre tabindex=\"0\">{}</pre>\n", EscapeHtml(section.preformatted));
  }
  return html + "</section>\n";
}

}  // namespace

std::string TableNumber(double value) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, std::abs(value) < 1e5 ? 3 : 0) : "";
}

ReportImage ReportImageFromFile(const std::filesystem::path& path, std::string caption,
                                std::string alt) {
  return {.bytes = ReadFileBytes(path), .caption = std::move(caption), .alt = std::move(alt)};
}

std::string ReportHtml(const Report& report) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<header>\n<h1>{}</h1>\n",
      kPolicy, EscapeHtml(report.title), ReportStyle(), EscapeHtml(report.title));
  if (!report.subtitle.empty()) {
    html += fmt::format("<p class=\"subtitle\">{}</p>\n", EscapeHtml(report.subtitle));
  }
  html += NavigationHtml(report.sections) + "</header>\n<main>\n" + TilesHtml(report.tiles);
  for (const ReportImage& image : report.main_images) {
    html += ImageHtml(image);
  }
  html += ViewHtml(report.scenes, report.scenes_note);
  for (std::size_t i = 0; i < report.sections.size(); ++i) {
    html += SectionHtml(report.sections[i], i + 1);
  }
  html += "</main>\n";
  if (!report.footer.empty()) {
    html += fmt::format("<footer>{}</footer>\n", EscapeHtml(report.footer));
  }
  return html + Script(ReportTableScript()) + "</body>\n</html>\n";
}

std::string EscapeHtml(std::string_view text) {
  std::string html;
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    switch (c) {
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
        html += c;
        break;
      case '\r':
        break;
      default:
        if (code < 0x20 || code == 0x7F) {
          html += "\uFFFD";
        } else {
          html += c;
        }
    }
  }
  return html;
}

std::string Base64(std::string_view bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = (group << 8) | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= count ? kDigits[(group >> (18 - 6 * k)) & 63] : '=';
    }
  }
  return text;
}

}  // namespace semblance
