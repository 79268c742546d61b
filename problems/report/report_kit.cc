// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/report_kit.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <utility>

#include "problems/report/pictures/image.h"
#include "problems/report/plots/svg_parts.h"
#include "problems/report/report_assets.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
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

// " width=.. height=.." for a PNG, so that the page does not jump while it loads. Empty for others.
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
  return fmt::format(" width=\"{}\" height=\"{}\"", width, height);
}

// An SVG becomes part of the page, so that its titles appear under the pointer and its colours
// follow those of the page.
std::string PictureHtml(const ReportImage& image) {
  if (MimeType(image) == "image/png") {
    return fmt::format("<img alt=\"{}\"{} src=\"data:image/png;base64,{}\">", EscapeHtml(image.alt),
                       SizeAttributes(image.bytes), Base64(image.bytes));
  }
  return fmt::format("<svg class=\"plot\" role=\"img\" aria-label=\"{}\"{}", EscapeHtml(image.alt),
                     image.bytes.substr(image.bytes.find("<svg") + 4));
}

// Five evenly spaced values of the map. Only a map with negative values shows plus signs.
std::string LegendTicks(const ColourMap& map) {
  constexpr int kSteps = 4;
  std::string html;
  for (int k = 0; k <= kSteps; ++k) {
    const double value = map.low_mm + (map.high_mm - map.low_mm) * k / kSteps;
    const char* const sign = value < 0 ? "\u2212" : map.low_mm < 0 && value > 0 ? "+" : "";
    html += fmt::format("<span>{}{:.3g}</span>", sign, std::abs(value));
  }
  return html;
}

std::string LegendHtml(const Legend& legend) {
  return fmt::format(
      "<div class=\"view3d-legend\"><div>{}{}</div><div class=\"view3d-bar\" "
      "style=\"background:linear-gradient(to right,{})\"></div><div "
      "class=\"view3d-ticks\">{}</div>{}</div>",
      EscapeHtml(legend.title),
      legend.unit.empty() ? "" : fmt::format(" ({})", EscapeHtml(legend.unit)),
      fmt::join(ColourSteps(legend.map), ","), LegendTicks(legend.map),
      legend.shows_no_data ? fmt::format("<small><i style=\"background:{}\"></i>no data</small>",
                                         HexText(kNoDataColour))
                           : "");
}

std::string ImageHtml(const ReportImage& image) {
  if (image.alt.empty()) {
    throw InputError(
        fmt::format("report image '{}': it has no alt text; describe in a few words what it shows",
                    image.caption));
  }
  std::string html = "<figure>" + PictureHtml(image);
  for (const Legend& legend : image.legends) {
    html += LegendHtml(legend);
  }
  if (!image.caption.empty()) {
    html += fmt::format("<figcaption>{}</figcaption>", EscapeHtml(image.caption));
  }
  return html + "</figure>\n";
}

// True for a number with an optional sign, unit or spread: "1.84", "-3 mm", "1.2 ± 0.4", "12 %".
bool IsNumeric(const std::string& cell) {
  std::size_t i = 0;
  for (const std::string_view sign : {"+", "-", "\u2212", "\u00b1", "<", ">"}) {
    i = std::string_view(cell).starts_with(sign) ? sign.size() : i;
  }
  const bool starts_with_digit =
      i < cell.size() && std::isdigit(static_cast<unsigned char>(cell[i]));
  const bool is_list = cell.find(", ") != cell.npos;  // words that begin with a number
  return (starts_with_digit && !is_list && cell.size() <= 24) || cell == "NaN" || cell == "inf";
}

// True for each column whose cells are numbers or empty.
std::vector<bool> NumericColumns(const ReportTable& table) {
  std::vector<bool> numeric(table.header.size(), false);
  for (std::size_t c = 0; c < numeric.size(); ++c) {
    bool has_text = table.rows.empty();
    for (const auto& row : table.rows) {
      has_text |= !row[c].empty() && row[c] != "-" && row[c] != "\u2013" && !IsNumeric(row[c]);
    }
    numeric[c] = !has_text;
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

std::string HeadHtml(const ReportTable& table, const std::vector<bool>& numeric) {
  std::string html = "<tr>";
  for (std::size_t c = 0; c < table.header.size(); ++c) {
    html += fmt::format("<th scope=\"col\"{}>{}</th>", numeric[c] ? " class=\"n\"" : "",
                        EscapeHtml(table.header[c]));
  }
  return html + "</tr>\n";
}

// Each cell repeats the head of its column, which a narrow screen shows in front of the cell.
std::string RowHtml(const ReportTable& table, std::size_t r, const std::vector<bool>& numeric) {
  const std::string id = r < table.ids.size() ? table.ids[r] : "",
                    link = r < table.links.size() ? table.links[r] : "";
  std::string html = id.empty() ? "<tr>" : fmt::format("<tr id=\"{}\">", EscapeHtml(id));
  for (std::size_t c = 0; c < table.header.size(); ++c) {
    const std::string& cell = table.rows[r][c];
    std::string text = cell.empty() ? "\u2013" : EscapeHtml(cell);
    if (c == 0 && !link.empty()) {
      text = fmt::format("<a href=\"{}\">{}</a>", EscapeHtml(link), text);
    }
    html += fmt::format("<td{} data-head=\"{}\">{}</td>", numeric[c] ? " class=\"n\"" : "",
                        EscapeHtml(table.header[c]), text);
  }
  return html + "</tr>\n";
}

std::string TableHtml(const ReportTable& table) {
  constexpr std::size_t kPhoneColumns = 3;  // more become cards on a narrow screen
  constexpr std::size_t kLongTable = 12;    // rows; longer tables can be filtered
  CheckTable(table);
  const std::vector<bool> numeric = NumericColumns(table);
  std::string html = fmt::format("<div class=\"scroll\" tabindex=\"0\"><table{}{}>\n",
                                 table.header.size() > kPhoneColumns ? " class=\"cards\"" : "",
                                 table.rows.size() > kLongTable ? " data-filter=\"\"" : "");
  if (!table.caption.empty()) {
    html += fmt::format("<caption>{}</caption>\n", EscapeHtml(table.caption));
  }
  html += "<thead>" + HeadHtml(table, numeric) + "</thead>\n<tbody>\n";
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    html += RowHtml(table, r, numeric);
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

std::string FaultsHtml(const std::vector<std::string>& faults) {
  if (faults.empty()) {
    return {};
  }
  std::string html = "<section class=\"notes\">\n";
  for (const std::string& fault : faults) {
    html += fmt::format("<p class=\"fault\">The result is not usable: {}</p>\n", EscapeHtml(fault));
  }
  return html + "</section>\n";
}

// The answer stays on the first screen: more notes than this are opened by a click.
constexpr std::size_t kShownNotes = 3;

std::string NotesHtml(const std::vector<std::string>& notes) {
  if (notes.empty()) {
    return {};
  }
  std::string html = "<section class=\"notes\">\n<h2 id=\"notes\">Notes</h2>\n";
  for (std::size_t k = 0; k < notes.size(); ++k) {
    if (k == kShownNotes) {
      html += fmt::format("<details><summary>{} more</summary>\n", notes.size() - k);
    }
    html += fmt::format("<p>{}</p>\n", EscapeHtml(notes[k]));
  }
  return html + (notes.size() > kShownNotes ? "</details>\n" : "") + "</section>\n";
}

std::string ScoreHtml(const Report& report) {
  if (report.tiles.empty() && report.score_images.empty()) {
    return {};
  }
  std::string html =
      fmt::format("<section>\n<h2 id=\"score\">{}</h2>\n", EscapeHtml(report.score_heading));
  html += TilesHtml(report.tiles);
  for (const ReportImage& image : report.score_images) {
    html += ImageHtml(image);
  }
  return html + "</section>\n";
}

// The ids and headings of the page's sections, in order.
std::vector<std::pair<std::string, std::string>> Headings(const Report& report) {
  std::vector<std::pair<std::string, std::string>> headings;
  if (!report.scenes.empty()) {
    headings.emplace_back("view", "In three dimensions");
  }
  if (!report.tiles.empty() || !report.score_images.empty()) {
    headings.emplace_back("score", report.score_heading);
  }
  if (!report.notes.empty()) {
    headings.emplace_back("notes", "Notes");
  }
  for (std::size_t k = 0; k < report.sections.size(); ++k) {
    headings.emplace_back(fmt::format("s{}", k + 1), report.sections[k].heading);
  }
  return headings;
}

std::string NavigationHtml(const Report& report) {
  const auto headings = Headings(report);
  if (headings.size() < 2) {
    return {};
  }
  std::string html =
      "<nav aria-label=\"Contents\"><details open=\"\"><summary>Contents</summary>\n<ul>\n";
  for (const auto& [id, heading] : headings) {
    html += fmt::format("<li><a href=\"#{}\">{}</a></li>\n", id, EscapeHtml(heading));
  }
  return html + "</ul></details></nav>\n";
}

// The content security policy: the page must not load anything from outside itself.
constexpr std::string_view kPolicy =
    "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src "
    "'unsafe-inline'";

std::string Script(std::string_view text) { return fmt::format("<script>\n{}</script>\n", text); }

// In JSON, "<" occurs only inside strings. It is written as \\u003c there, so that no "</script>"
// ends the block early.
std::string JsonScript(const std::string& id, const std::string& json) {
  std::string html = fmt::format("<script type=\"application/json\" id=\"{}\">", id);
  for (const char c : json) {
    if (c == '<') {
      html += "\\u003c";
    } else {
      html += c;
    }
  }
  return html + "</script>\n";
}

// The 3-D view with its data and scripts, or a sentence in its place.
std::string ViewHtml(const std::string& scenes, const std::string& note) {
  if (scenes.empty()) {
    return {};
  }
  std::string html = "<section>\n<h2 id=\"view\">In three dimensions</h2>\n";
  if (ThreeScript().empty()) {
    return html +
           "<p class=\"no-view\">There is no 3-D view here: the program that wrote this page was "
           "built without three.js (Debian: libjs-three). Build it with three.js, then run "
           "semblance "
           "report to write this page again.</p>\n</section>\n";
  }
  html +=
      "<div id=\"view3d\"><noscript><p class=\"no-view\">The 3-D view needs JavaScript, which is "
      "off in this browser. The pictures need no script.</p></noscript></div>\n";
  html += JsonScript("view3d-scenes", scenes);
  html += note.empty() ? "" : fmt::format("<p>{}</p>\n", EscapeHtml(note));
  html += "</section>\n";
  return html + Script(ThreeScript()) + Script(ReportViewScript());
}

std::string SectionBody(const ReportSection& section) {
  std::string html;
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
  return html;
}

std::string SectionHtml(const ReportSection& section, std::size_t number) {
  const std::string heading =
      fmt::format("<h2 id=\"s{}\">{}</h2>", number, EscapeHtml(section.heading));
  return section.folded
             ? fmt::format("<details class=\"fold\"><summary>{}</summary>\n{}</details>\n", heading,
                           SectionBody(section))
             : fmt::format("<section>\n{}\n{}</section>\n", heading, SectionBody(section));
}

}  // namespace

std::string TableNumber(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, std::abs(value) < 1e5 ? digits : 0)
                              : "";
}

std::string TableFigures(double value) {
  return std::isfinite(value) ? fmt::format("{:.3g}", value) : "";
}

std::string TablePercent(double share) {
  return std::isfinite(share) ? fmt::format("{:.1f}", 100 * share) : "";
}

std::string IntervalText(const Interval& interval) {
  return std::isfinite(interval.low)
             ? fmt::format("{} to {}", TableNumber(interval.low), TableNumber(interval.high))
             : "";
}

std::vector<ReportTable> WithoutEmptyTables(std::vector<ReportTable> tables) {
  std::erase_if(tables, [](const ReportTable& table) { return table.rows.empty(); });
  return tables;
}

ReportImage ReportImageFromFile(const std::filesystem::path& path, std::string caption,
                                std::string alt, std::vector<Legend> legends) {
  std::string bytes = ReadFileBytes(path);
  return {.bytes = path.extension() == ".png" ? PagePng(bytes) : std::move(bytes),
          .caption = std::move(caption),
          .alt = std::move(alt),
          .legends = std::move(legends)};
}

ReportImage SubjectBoxPlot(const std::vector<BoxRow>& rows, const std::string& axis_label,
                           std::string alt) {
  return {.bytes = BoxPlotSvg(rows, axis_label),
          .caption = "One dot per subject; box: quartiles and median.",
          .alt = std::move(alt)};
}

std::string ReportHtml(const Report& report) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body "
      "class=\"report\">\n<header>\n<h1>{}</h1>\n",
      kPolicy, EscapeHtml(report.title), ReportStyle(), EscapeHtml(report.title));
  if (!report.subtitle.empty()) {
    html += fmt::format("<p class=\"subtitle\">{}</p>\n", EscapeHtml(report.subtitle));
  }
  html += "</header>\n" + NavigationHtml(report) + "<main>\n" + FaultsHtml(report.faults);
  for (const ReportImage& image : report.main_images) {
    html += ImageHtml(image);
  }
  html += ViewHtml(report.scenes, report.scenes_note) + ScoreHtml(report) + NotesHtml(report.notes);
  for (std::size_t i = 0; i < report.sections.size(); ++i) {
    html += SectionHtml(report.sections[i], i + 1);
  }
  html += fmt::format("</main>\n<footer>semblance {}{}{}</footer>\n", SEMBLANCE_VERSION,
                      report.footer.empty() ? "" : "; ", EscapeHtml(report.footer));
  return html + Script(ReportPageScript()) + "</body>\n</html>\n";
}

}  // namespace semblance::problems
