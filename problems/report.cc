// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdint>

#include "problems/files.h"
#include "surfaces/error.h"

namespace semblance {
namespace {

constexpr std::string_view kStyle = R"css(
:root { color-scheme: light dark; --paper: #fff; --ink: #1d2126; --soft: #5c6570; --line: #dfe3e8;
  --card: #f5f7f9; --accent: #0b5c8f; }
@media (prefers-color-scheme: dark) { :root { --paper: #14171a; --ink: #e6e9ec; --soft: #9aa4af;
  --line: #2d343b; --card: #1c2126; --accent: #7cc0ee; } }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0 auto; max-width: 76rem; padding: 1.5rem clamp(1rem, 3vw, 2.5rem) 3rem;
  background: var(--paper); color: var(--ink);
  font: 1rem/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
h1 { margin: 0; font-size: clamp(1.5rem, 3.2vw, 2.1rem); line-height: 1.2; letter-spacing: -.01em; }
h2 { margin: 2.6rem 0 .6rem; padding-top: .9rem; border-top: 1px solid var(--line);
  font-size: 1.3rem; line-height: 1.3; }
p { margin: .6rem 0; max-width: 46rem; overflow-wrap: break-word; }
.subtitle { margin: .3rem 0 0; color: var(--soft); }
nav { margin: .9rem 0 0; font-size: .92rem; }
nav a { margin-right: 1.1rem; color: var(--accent); text-decoration: none; }
nav a:hover, nav a:focus { text-decoration: underline; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(9.5rem, 1fr)); gap: .75rem;
  margin: 1.2rem 0; padding: 0; }
.tile { padding: .7rem .9rem .75rem; background: var(--card); border: 1px solid var(--line);
  border-radius: .6rem; }
.tile dt { color: var(--soft); font-size: .85rem; }
.tile dd { margin: 0; }
.value { font-size: 1.7rem; font-weight: 600; line-height: 1.25; font-variant-numeric: tabular-nums;
  overflow-wrap: anywhere; }
.unit { margin-left: .25rem; color: var(--soft); font-size: .95rem; font-weight: 400; }
.note { color: var(--soft); font-size: .82rem; line-height: 1.35; }
figure { margin: 1rem 0; }
figure img { display: block; max-width: 100%; height: auto; border: 1px solid var(--line);
  border-radius: .6rem; background: #fff; }
figcaption { margin-top: .4rem; max-width: 46rem; color: var(--soft); font-size: .9rem; }
.scroll { overflow-x: auto; margin: 1rem 0; }
figure .scroll { margin: 0; }
@media screen and (max-width: 44rem) { img.wide { width: 56rem; max-width: none; } }
table { border-collapse: collapse; font-size: .93rem; font-variant-numeric: tabular-nums; }
caption { padding: 0 0 .4rem; text-align: left; color: var(--soft); font-size: .9rem; }
th, td { padding: .32rem .9rem .32rem 0; border-bottom: 1px solid var(--line); text-align: left;
  vertical-align: top; }
th { border-bottom: 2px solid var(--line); font-weight: 600; }
th.n, td.n { padding-left: .9rem; padding-right: .4rem; text-align: right; white-space: nowrap; }
pre { overflow-x: auto; margin: 1rem 0; padding: .9rem 1rem; background: var(--card);
  border: 1px solid var(--line); border-radius: .6rem; font: .85rem/1.5 ui-monospace,
  SFMono-Regular, Menlo, Consolas, "Liberation Mono", monospace; }
footer { margin-top: 3rem; padding-top: .9rem; border-top: 1px solid var(--line);
  color: var(--soft); font-size: .85rem; }
@media print { :root { color-scheme: light; --paper: #fff; --ink: #000; --soft: #444;
  --line: #bbb; --card: #fff; --accent: #000; }
  body { max-width: none; padding: 0; font-size: 10pt; } nav { display: none; }
  figure, .tile, tr { break-inside: avoid; } h2 { break-after: avoid; }
  pre { white-space: pre-wrap; } .scroll { overflow: visible; } }
)css";

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

ReportImage ReportImageFromFile(const std::filesystem::path& path, std::string caption,
                                std::string alt) {
  return {.bytes = ReadFileBytes(path), .caption = std::move(caption), .alt = std::move(alt)};
}

std::string ReportHtml(const Report& report) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<header>\n<h1>{}</h1>\n",
      EscapeHtml(report.title), kStyle, EscapeHtml(report.title));
  if (!report.subtitle.empty()) {
    html += fmt::format("<p class=\"subtitle\">{}</p>\n", EscapeHtml(report.subtitle));
  }
  html += NavigationHtml(report.sections) + "</header>\n<main>\n" + TilesHtml(report.tiles);
  for (const ReportImage& image : report.main_images) {
    html += ImageHtml(image);
  }
  for (std::size_t i = 0; i < report.sections.size(); ++i) {
    html += SectionHtml(report.sections[i], i + 1);
  }
  html += "</main>\n";
  if (!report.footer.empty()) {
    html += fmt::format("<footer>{}</footer>\n", EscapeHtml(report.footer));
  }
  return html + "</body>\n</html>\n";
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
