// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/landmark_files/point_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <pugixml.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

std::string_view TrimBlanks(std::string_view text) {
  const std::size_t first = std::min(text.find_first_not_of(kBlanks), text.size());
  text.remove_prefix(first);
  return text.substr(0, text.find_last_not_of(kBlanks) + 1);
}

// The cells of one line, trimmed. A cell may be quoted, with "" for a quote inside.
std::vector<std::string> SplitCells(std::string_view line, char separator) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t k = 0; k < line.size(); ++k) {
    if (line[k] == '"' && quoted && line.substr(k + 1, 1) == "\"") {
      cells.back() += line[++k];
    } else if (line[k] == '"') {
      quoted = !quoted;
    } else if (line[k] == separator && !quoted) {
      cells.emplace_back();
    } else {
      cells.back() += line[k];
    }
  }
  for (std::string& cell : cells) {
    cell = TrimBlanks(cell);
  }
  return cells;
}

// Iterates over the lines of a text that are not empty. Any fault is an IoError with the file's
// name and, after the first Next, the line number. The text must outlive the object.
class PointLines {
 public:
  PointLines(std::string_view text, std::string_view file);

  bool Next();  // goes to the next line that is not empty; false at the end
  std::string_view line() const { return line_; }

  double Number(std::string_view cell) const;  // a finite decimal number
  [[noreturn]] void Fail(std::string_view what) const;

 private:
  std::string_view rest_;
  std::string file_;
  std::string_view line_;
  int number_ = 0;
};

PointLines::PointLines(std::string_view text, std::string_view file) : rest_(text), file_(file) {
  if (rest_.starts_with("\xEF\xBB\xBF")) {
    rest_.remove_prefix(3);  // the byte order mark that spreadsheets write before UTF-8
  }
}

bool PointLines::Next() {
  do {
    if (rest_.empty()) {
      return false;
    }
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    line_ = TrimBlanks(rest_.substr(0, end));
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++number_;
  } while (line_.empty());
  return true;
}

double PointLines::Number(std::string_view cell) const {
  double value = kNaN;
  const std::string_view digits = cell.starts_with('+') ? cell.substr(1) : cell;
  const char* const last = digits.data() + digits.size();
  const auto [end, error] = std::from_chars(digits.data(), last, value);
  if (error != std::errc{} || end != last || !std::isfinite(value)) {
    Fail(fmt::format("'{}' is not a finite decimal number", cell));
  }
  return value;
}

void PointLines::Fail(std::string_view what) const {
  throw IoError(number_ > 0 ? fmt::format("{}:{}: {}", file_, number_, what)
                            : fmt::format("{}: {}", file_, what));
}

// The contents of the lines that begin with '#'.
struct FcsvHeader {
  std::string axes;
  std::vector<std::string> columns = {
      "id", "x",   "y",   "z",    "ow",    "ox",   "oy",
      "oz", "vis", "sel", "lock", "label", "desc", "associatedNodeID"};

  std::size_t Column(const PointLines& lines, std::string_view name) const {
    const auto found = std::find(columns.begin(), columns.end(), name);
    if (found == columns.end()) {
      lines.Fail(
          fmt::format("there is no column '{}'; there are {}", name, fmt::join(columns, ", ")));
    }
    return static_cast<std::size_t>(found - columns.begin());
  }
};

std::string ReadAxes(const PointLines& lines, std::string_view word) {
  if (word == "LPS" || word == "1") {
    return "LPS";
  }
  if (word == "RAS" || word == "0") {
    return "RAS";
  }
  lines.Fail(fmt::format("the coordinate system is '{}'; it must be LPS or RAS", word));
}

// Reads "# CoordinateSystem = LPS" or "# columns = id,x,y,z,..."; ignores other lines.
void ReadHeaderLine(const PointLines& lines, FcsvHeader& header) {
  const std::string_view line = lines.line();
  const std::size_t equals = line.find('=');
  if (equals == line.npos) {
    return;
  }
  const std::string_view value = TrimBlanks(line.substr(equals + 1));
  if (line.find("CoordinateSystem") < equals) {
    const std::string axes = ReadAxes(lines, value);
    if (!header.axes.empty() && header.axes != axes) {
      lines.Fail("a second coordinate system, which differs from the first; keep the right one");
    }
    header.axes = axes;
  } else if (line.find("columns") < equals) {
    header.columns = SplitCells(value, ',');
    constexpr std::size_t kMaxColumns = 100;  // each point searches the columns by name
    if (header.columns.size() > kMaxColumns) {
      lines.Fail(fmt::format("{} columns; Slicer writes 14, and no more than {} are read",
                             header.columns.size(), kMaxColumns));
    }
  }
}

// The status of a point, which Slicer writes behind the cells that the header names; empty if there
// is none.
std::string TakeStatus(const PointLines& lines, const FcsvHeader& header,
                       std::vector<std::string>& cells) {
  const std::size_t named = header.columns.size();
  while (cells.size() > named && cells.back().empty()) {
    cells.pop_back();  // follows a separator at the line's end
  }
  if (cells.size() > named + 2) {
    lines.Fail(fmt::format(
        "{} cells, where the header names {} and Slicer adds at most 2; quote texts with commas, "
        "and write decimal points",
        cells.size(), named));
  }
  return cells.size() > named ? cells[named] : "";
}

// Adds the point of a row, or its site as absent. Adds its site to `hidden` if Slicer hides it.
void ReadFcsvRow(const PointLines& lines, const FcsvHeader& header, LandmarkFile& file,
                 std::vector<std::string>& hidden) {
  std::vector<std::string> cells = SplitCells(lines.line(), ',');
  const std::string status = TakeStatus(lines, header, cells);
  const auto cell = [&](std::string_view name) {
    const std::size_t column = header.Column(lines, name);
    return column < cells.size() ? cells[column] : std::string();
  };
  const auto optional_cell = [&](std::string_view name) {
    return std::ranges::find(header.columns, name) != header.columns.end() ? cell(name) : "";
  };
  Landmark landmark;
  landmark.site = cell("label");
  try {
    if (const std::string reason = status.empty() ? "" : AbsenceReason(status); !reason.empty()) {
      file.absent.push_back({landmark.site, reason});
      return;
    }
  } catch (const IoError& error) {
    lines.Fail(error.what());
  }
  landmark.point = {lines.Number(cell("x")), lines.Number(cell("y")), lines.Number(cell("z"))};
  landmark.note = optional_cell("desc");
  if (optional_cell("vis") == "0" || optional_cell("sel") == "0") {
    hidden.push_back(landmark.site);
  }
  file.landmarks.push_back(landmark);
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

LandmarkFile WithoutAxes() {
  return {.subject = "", .units = "mm", .axes = "", .landmarks = {}, .absent = {}};
}

char FindSeparator(std::string_view line) {
  return line.find(';') != line.npos ? ';' : line.find(',') != line.npos ? ',' : ' ';
}

constexpr std::array kEntries = {"name", "x", "y", "z"};
constexpr std::array kCoordinates = {"x", "y", "z"};

// `where` names file and point, for messages.
std::array<double, 3> ReadCoordinates(const pugi::xml_node& point, const std::string& where) {
  std::array<double, 3> values;
  for (std::size_t d = 0; d < kCoordinates.size(); ++d) {
    const PointLines number("", fmt::format("{}: attribute {}", where, kCoordinates[d]));
    const pugi::xml_attribute attribute = point.attribute(kCoordinates[d]);
    if (!attribute) {
      number.Fail("missing; place the point again in MeshLab");
    }
    values[d] = number.Number(attribute.as_string());
  }
  return values;
}

// Several blanks are one separator. Between commas or semicolons an empty cell is a missing entry.
std::vector<std::string> SplitPointLine(std::string_view line) {
  std::string blanks(line);
  std::replace(blanks.begin(), blanks.end(), '\t', ' ');
  const char separator = FindSeparator(blanks);
  std::vector<std::string> cells = SplitCells(blanks, separator);
  if (separator == ' ') {
    std::erase(cells, "");
  } else if (cells.size() == kEntries.size() + 1 && cells.back().empty()) {
    cells.pop_back();  // follows a separator at the line's end
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

Landmark ReadListedPoint(const PointLines& lines) {
  const std::vector<std::string> cells = SplitPointLine(lines.line());
  RequireEntries(lines, cells);
  Landmark landmark;
  landmark.site = cells[0];
  landmark.point = {lines.Number(cells[1]), lines.Number(cells[2]), lines.Number(cells[3])};
  return landmark;
}

}  // namespace

std::string AbsenceReason(std::string_view status) {
  if (status == "defined" || status == "2") {
    return "";
  }
  if (status == "undefined" || status == "0") {
    return "not placed";
  }
  if (status == "missing" || status == "3") {
    return "marked as missing in Slicer";
  }
  if (status == "preview" || status == "1") {
    return "not placed, only previewed in Slicer";
  }
  throw IoError(fmt::format(
      "the position status is '{}'; it must be defined (2), undefined (0), missing (3) or preview "
      "(1)",
      status));
}

void NoteHidden(std::string_view file, const std::vector<std::string>& sites,
                std::vector<std::string>& notes) {
  if (!sites.empty()) {
    notes.push_back(fmt::format(
        "{}: hidden or not selected in Slicer, and read all the same: {}; delete points that do "
        "not count, or mark them as missing",
        file, fmt::join(sites, ", ")));
  }
}

LandmarkFile ParseFcsv(std::string_view text, std::string_view file,
                       std::vector<std::string>& notes) {
  LandmarkFile result{.subject = "", .units = "mm", .axes = "", .landmarks = {}, .absent = {}};
  FcsvHeader header;
  PointLines lines(text, file);
  std::vector<std::string> hidden;
  while (lines.Next()) {
    if (lines.line().front() == '#') {
      ReadHeaderLine(lines, header);
    } else {
      ReadFcsvRow(lines, header, result, hidden);
    }
  }
  result.axes = header.axes;
  NoteHidden(file, hidden, notes);
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

LandmarkFile ParseMeshLabPoints(std::string_view text, std::string_view file) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(text.data(), text.size());
  const pugi::xml_node root = document.child("PickedPoints");
  if (!parsed || !root) {
    throw IoError(fmt::format("{}: no PickedPoints of MeshLab{}; save the points again", file,
                              parsed ? "" : fmt::format(" ({})", parsed.description())));
  }
  int number = 0;
  LandmarkFile result = WithoutAxes();
  for (const pugi::xml_node& point : root.children("point")) {
    Landmark landmark;
    landmark.site = point.attribute("name").as_string();
    ++number;
    if (!point.attribute("active").as_bool(/*def=*/true)) {
      result.absent.push_back({landmark.site, "not active"});
    } else {
      landmark.point =
          ReadCoordinates(point, fmt::format("{}: point {} '{}'", file, number, landmark.site));
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
      result.landmarks.push_back(ReadListedPoint(lines));
    }
  }
  return result;
}

}  // namespace semblance::problems
