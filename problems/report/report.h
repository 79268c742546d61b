// SPDX-License-Identifier: GPL-3.0-or-later
// A report as one HTML file that needs nothing else: no network, no other file. Its scripts sort
// tables and show the 3-D view; without them all the rest is still there.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace semblance {

// All text is plain: it is escaped on the way out.
struct ReportTile {
  std::string label;  // e.g. "mean error"
  std::string value;  // e.g. "1.84"
  std::string unit;   // e.g. "mm"; may be empty
  std::string note;   // small print below; may be empty
};

struct ReportTable {
  std::string caption;
  std::vector<std::string> header;             // with units, e.g. "depth (mm)"
  std::vector<std::vector<std::string>> rows;  // as many cells each as the header; a column of
                                               // numbers is aligned right; empty: a dash
  // Per row, or none: its id in the page, and where its first cell leads ("#id" or a file beside
  // the page); an empty one: no id, no link.
  std::vector<std::string> ids = {}, links = {};
  bool filter = false;  // a field above it that hides the rows without the words typed there
};

// A table's number: `digits` decimals, none from 100,000 on; nothing where it is not finite.
std::string TableNumber(double value, int digits = 3);

struct ReportImage {
  std::string bytes;    // of a PNG or SVG file
  std::string caption;  // below it; may be empty
  std::string alt;      // what it shows, for those who do not see it; not empty
};

struct ReportSection {
  std::string heading;
  std::vector<std::string> paragraphs = {};
  std::vector<ReportImage> images = {};
  std::vector<ReportTable> tables = {};
  std::string preformatted = {};  // e.g. the configuration; may be empty
  bool folded = false;            // shown by its heading alone until it is opened
};

// The page shows its parts in this order.
struct Report {
  std::string title;
  std::string subtitle;
  std::vector<std::string> notes = {};   // what a reader must know before looking
  std::string scenes = {};               // CollectScenes (scene_json.h) for the 3-D view; empty:
                                         // none. Words in its place where the program lacks
                                         // three.js, or the browser WebGL
  std::string scenes_note = {};          // below it; may be empty
  std::vector<ReportImage> main_images;  // the first picture people see, usually one
  std::string score_heading = "In figures";
  std::vector<ReportTile> tiles;               // the key numbers
  std::vector<ReportImage> score_images = {};  // what they were taken of
  std::vector<ReportSection> sections;
  std::string footer;  // e.g. the version; no time, so that the same run gives the same bytes
};

// Throws IoError if the file cannot be read.
ReportImage ReportImageFromFile(const std::filesystem::path& path, std::string caption,
                                std::string alt);

// HTML5 with the pictures inside, an SVG as part of the page; the same report gives the same bytes.
// Throws InputError for an image that is neither PNG nor SVG or has no alt text, and for a table
// row that is not as long as the header.
std::string ReportHtml(const Report& report);

}  // namespace semblance
