// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/landmark_files/fcsv.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "problems/landmark_files/point_lines.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

// What the lines that begin with '#' say.
struct Header {
  std::string axes;
  std::vector<std::string> columns = {"id", "x", "y", "z", "", "", "", "", "", "", "", "label"};

  std::size_t ColumnOf(const PointLines& lines, std::string_view name) const {
    const auto found = std::find(columns.begin(), columns.end(), name);
    if (found == columns.end()) {
      lines.Fail(
          fmt::format("there is no column '{}'; there are {}", name, fmt::join(columns, ", ")));
    }
    return static_cast<std::size_t>(found - columns.begin());
  }
};

std::string AxesOf(const PointLines& lines, std::string_view word) {
  if (word == "LPS" || word == "1") {
    return "LPS";
  }
  if (word == "RAS" || word == "0") {
    return "RAS";
  }
  lines.Fail(fmt::format("the coordinate system is '{}'; it must be LPS or RAS", word));
}

// "# CoordinateSystem = LPS", "# columns = id,x,y,z,...", or something else.
void ReadHeaderLine(const PointLines& lines, Header& header) {
  const std::string_view line = lines.line();
  const std::size_t equals = line.find('=');
  if (equals == line.npos) {
    return;
  }
  const std::string_view value = TrimBlanks(line.substr(equals + 1));
  if (line.find("CoordinateSystem") < equals) {
    header.axes = AxesOf(lines, value);
  } else if (line.find("columns") < equals) {
    header.columns = SplitCells(value, ',');
    constexpr std::size_t kMost = 100;  // each point looks its own up
    if (header.columns.size() > kMost) {
      lines.Fail(fmt::format("{} columns; Slicer writes 14, and no more than {} are read",
                             header.columns.size(), kMost));
    }
  }
}

Landmark PointOf(const PointLines& lines, const Header& header) {
  const std::vector<std::string> cells = SplitCells(lines.line(), ',');
  const auto cell = [&](std::string_view name) {
    const std::size_t column = header.ColumnOf(lines, name);
    return column < cells.size() ? cells[column] : std::string();
  };
  Landmark landmark;
  landmark.site = cell("label");
  landmark.point = {lines.Number(cell("x")), lines.Number(cell("y")), lines.Number(cell("z"))};
  const bool described = std::ranges::find(header.columns, "desc") != header.columns.end();
  landmark.note = described ? cell("desc") : "";
  return landmark;
}

std::string Quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == text.npos) {
    return text;
  }
  std::string quoted = "\"";
  for (const char c : text) {
    quoted.append(c == '"' ? 2 : 1, c == '\n' || c == '\r' ? ' ' : c);
  }
  return quoted + '"';
}

}  // namespace

LandmarkFile ParseFcsv(std::string_view text, std::string_view file) {
  LandmarkFile result{.subject = "", .units = "mm", .axes = "", .landmarks = {}, .absent = {}};
  Header header;
  PointLines lines(text, file);
  while (lines.Next()) {
    if (lines.line().front() == '#') {
      ReadHeaderLine(lines, header);
    } else {
      result.landmarks.push_back(PointOf(lines, header));
    }
  }
  if (header.axes.empty()) {
    lines.Fail("no line '# CoordinateSystem = ...' says LPS or RAS; save the list anew in Slicer");
  }
  result.axes = header.axes;
  return result;
}

std::string Fcsv(const LandmarkFile& file) {
  std::string text =
      "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n"
      "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n";
  for (std::size_t k = 0; k < file.landmarks.size(); ++k) {
    const Landmark& landmark = file.landmarks[k];
    text += fmt::format("{},{},{},{},0,0,0,1,1,1,0,{},{},\n", k + 1, landmark.point[0],
                        landmark.point[1], landmark.point[2], Quoted(landmark.site),
                        Quoted(landmark.note));
  }
  return text;
}

}  // namespace semblance
