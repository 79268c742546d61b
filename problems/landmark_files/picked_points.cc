// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/landmark_files/picked_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <pugixml.hpp>
#include <sstream>

#include "problems/landmark_files/point_lines.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

LandmarkFile WithoutAxes() {
  return {.subject = "", .units = "mm", .axes = "", .landmarks = {}, .absent = {}};
}

char SeparatorOf(std::string_view line) {
  return line.find(';') != line.npos ? ';' : line.find(',') != line.npos ? ',' : ' ';
}

constexpr std::array kEntries = {"name", "x", "y", "z"};

constexpr std::array kCoordinates = {"x", "y", "z"};

// where: file and point, for messages.
std::array<double, 3> CoordinatesOf(const pugi::xml_node& point, const std::string& where) {
  std::array<double, 3> values;
  for (std::size_t d = 0; d < kCoordinates.size(); ++d) {
    const PointLines number("", fmt::format("{}: attribute {}", where, kCoordinates[d]));
    const pugi::xml_attribute attribute = point.attribute(kCoordinates[d]);
    if (!attribute) {
      number.Fail("there is none; place the point anew in MeshLab");
    }
    values[d] = number.Number(attribute.as_string());
  }
  return values;
}

// Several blanks are one separator; between commas or semicolons an empty cell is one that lacks.
std::vector<std::string> CellsOf(std::string_view line) {
  std::string blanks(line);
  std::replace(blanks.begin(), blanks.end(), '\t', ' ');
  const char separator = SeparatorOf(blanks);
  std::vector<std::string> cells = SplitCells(blanks, separator);
  if (separator == ' ') {
    std::erase(cells, "");
  } else if (cells.size() == kEntries.size() + 1 && cells.back().empty()) {
    cells.pop_back();  // after a separator at the line's end
  }
  return cells;
}

void RequireEntries(const PointLines& lines, const std::vector<std::string>& cells) {
  if (cells.size() == 3 || (cells.size() == kEntries.size() && cells[0].empty())) {
    lines.Fail("the point has no name; export the list with labels, as: label, x, y, z");
  }
  if (cells.size() != kEntries.size()) {
    lines.Fail(fmt::format("{} entries; a line must have a name, x, y and z", cells.size()));
  }
  const auto empty = std::ranges::find(cells, "");
  if (empty != cells.end()) {
    const auto column = empty - cells.begin();
    lines.Fail(fmt::format("column {} ({}) is empty; a line must have a name, x, y and z",
                           column + 1, kEntries[static_cast<std::size_t>(column)]));
  }
}

Landmark PointOf(const PointLines& lines) {
  const std::vector<std::string> cells = CellsOf(lines.line());
  RequireEntries(lines, cells);
  Landmark landmark;
  landmark.site = cells[0];
  landmark.point = {lines.Number(cells[1]), lines.Number(cells[2]), lines.Number(cells[3])};
  return landmark;
}

}  // namespace

LandmarkFile ParseMeshLabPoints(std::string_view text, std::string_view file) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(text.data(), text.size());
  const pugi::xml_node root = document.child("PickedPoints");
  if (!parsed || !root) {
    throw IoError(fmt::format("{}: no PickedPoints of MeshLab{}; save the points anew", file,
                              parsed ? "" : fmt::format(" ({})", parsed.description())));
  }
  int number = 0;
  LandmarkFile result = WithoutAxes();
  for (const pugi::xml_node& point : root.children("point")) {
    Landmark landmark;
    landmark.site = point.attribute("name").as_string();
    ++number;
    if (point.attribute("active").as_string("1") == std::string_view("0")) {
      result.absent.push_back({landmark.site, "not active"});
    } else {
      landmark.point =
          CoordinatesOf(point, fmt::format("{}: point {} '{}'", file, number, landmark.site));
      result.landmarks.push_back(landmark);
    }
  }
  return result;
}

std::string MeshLabPoints(const LandmarkFile& file) {
  pugi::xml_document document;
  document.append_child(pugi::node_doctype).set_value("PickedPoints");
  pugi::xml_node root = document.append_child("PickedPoints");
  for (const Landmark& landmark : file.landmarks) {
    pugi::xml_node point = root.append_child("point");
    for (std::size_t d = 0; d < kCoordinates.size(); ++d) {
      point.append_attribute(kCoordinates[d]) = fmt::format("{}", landmark.point[d]).c_str();
    }
    point.append_attribute("active") = "1";
    point.append_attribute("name") = landmark.site.c_str();
  }
  std::ostringstream text;
  document.save(text, " ", pugi::format_indent | pugi::format_no_declaration);
  return text.str();
}

LandmarkFile ParsePointList(std::string_view text, std::string_view file) {
  LandmarkFile result = WithoutAxes();
  PointLines lines(text, file);
  while (lines.Next()) {
    if (!lines.line().starts_with('#') && !lines.line().starts_with("//")) {
      result.landmarks.push_back(PointOf(lines));
    }
  }
  return result;
}

}  // namespace semblance
