// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of every report page: frame, notes, tiles, figures, tables and numbers. A page is one
// HTML file that needs no network and no other file. Its scripts sort and filter tables and show
// the 3-D view; without scripts everything else still works.
#pragma once

#include <concepts>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "problems/experiment/metrics/statistics.h"
#include "problems/report/pictures/colour_map.h"
#include "problems/report/plots/svg_plot.h"

namespace semblance::problems {

// All text of these structs is plain text. ReportHtml escapes it.
struct ReportTile {
  std::string label;  // e.g. "mean error"
  std::string value;  // e.g. "1.84"
  std::string unit;   // e.g. "mm"; may be empty
  std::string note;   // small print below; may be empty
};

// Cells of a table. A number that is not finite gives an empty cell.
std::string TableNumber(double value, int digits = 3);  // `digits` decimals; none from 100,000 on
std::string TableFigures(double value);                 // three significant figures
std::string TablePercent(double share);                 // "12.3" for a share of 0.123
std::string IntervalText(const Interval& interval);     // "1.200 to 3.400"
inline std::string CellText(std::string text) { return text; }
inline std::string CellText(std::floating_point auto value) { return TableNumber(value); }
inline std::string CellText(std::integral auto value) { return std::to_string(value); }

struct ReportTable {
  std::string caption;
  std::vector<std::string> header;                  // with units, e.g. "depth (mm)"
  std::vector<std::vector<std::string>> rows = {};  // each as long as the header
  std::vector<std::string> ids = {};                // the HTML id of each row, or empty
  std::vector<std::string> links = {};  // where the first cell of each row leads, or empty

  // Adds a row: text as it is, floating-point values by TableNumber, whole numbers in full.
  template <class... Values>
  void AddRow(const Values&... values) {
    rows.push_back({CellText(values)...});
  }
};

std::vector<ReportTable> WithoutEmptyTables(std::vector<ReportTable> tables);

struct ReportImage {
  std::string bytes;                 // of a PNG or SVG file
  std::string caption;               // below the picture; may be empty
  std::string alt;                   // text for readers who cannot see the picture; not empty
  std::vector<Legend> legends = {};  // keys to its colours, between picture and caption
};

// A picture from a file. A PNG becomes one for a page (PagePng, pictures/image.h). Throws IoError
// if the file cannot be read.
ReportImage ReportImageFromFile(const std::filesystem::path& path, std::string caption,
                                std::string alt, std::vector<Legend> legends = {});

// A box plot with one dot per subject.
ReportImage SubjectBoxPlot(const std::vector<BoxRow>& rows, const std::string& axis_label,
                           std::string alt);

struct ReportSection {
  std::string heading;
  std::vector<std::string> paragraphs = {};
  std::vector<ReportImage> images = {};
  std::vector<ReportTable> tables = {};
  std::string preformatted = {};  // e.g. the configuration; may be empty
  bool folded = false;            // shown by its heading alone until it is opened
};

// The page shows the answer first: faults, main pictures, 3-D view, numbers, notes, sections.
struct Report {
  std::string title;
  std::string subtitle;
  std::vector<std::string> faults = {};  // why the result is not usable; in red above all else
  // The most important first, below the numbers. From the fourth on they are folded away.
  std::vector<std::string> notes = {};
  std::vector<ReportImage> main_images = {};  // the first pictures, usually one
  std::string scenes = {};       // CollectScenes (scene_json.h) for the 3-D view, or empty
  std::string scenes_note = {};  // below the 3-D view; may be empty
  std::string score_heading = "In figures";
  std::vector<ReportTile> tiles = {};          // the key numbers
  std::vector<ReportImage> score_images = {};  // pictures that belong to the key numbers
  std::vector<ReportSection> sections = {};
  std::string footer = {};  // after the program's version; no time, so the bytes stay the same
};

// Returns an HTML5 page that contains its pictures. The same report gives the same bytes. Columns
// of numbers are aligned right, an empty cell shows a dash, and a table of more than 12 rows gets a
// field that filters its rows. Without three.js in the program, or WebGL in the browser, a sentence
// takes the place of the 3-D view. Throws InputError for an image that is neither PNG nor SVG or
// has no alt text, and for a table row that is not as long as the header.
std::string ReportHtml(const Report& report);

}  // namespace semblance::problems
