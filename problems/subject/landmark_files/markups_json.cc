// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/landmark_files/markups_json.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "problems/subject/landmark_files/point_files.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"

namespace semblance::problems {
namespace {

using json_parts::Json;

std::string ReadText(const Json& json, const char* key, const char* otherwise) {
  const auto found = json.find(key);
  if (found == json.end()) {
    return otherwise;
  }
  if (!found->is_string()) {
    throw IoError(fmt::format("'{}' must be a text", key));
  }
  return found->get<std::string>();
}

// Files before version 1.0 have numbers instead of names.
std::string ReadAxes(const Json& markup) {
  const auto found = markup.find("coordinateSystem");
  if (found == markup.end()) {
    throw IoError("'coordinateSystem' is missing; it must be \"LPS\" or \"RAS\"");
  }
  const std::string axes = found->is_string() ? found->get<std::string>() : found->dump();
  if (axes == "LPS" || axes == "1") {
    return "LPS";
  }
  if (axes == "RAS" || axes == "0") {
    return "RAS";
  }
  throw IoError(fmt::format("'coordinateSystem' is {}; it must be \"LPS\" or \"RAS\"", axes));
}

void RequireMillimetres(const Json& markup) {
  const std::string units = ReadText(markup, "coordinateUnits", "mm");
  if (units != "mm" && units.find("\"mm\"") == units.npos) {
    throw IoError(fmt::format("'coordinateUnits' is {}; export in mm", units));
  }
}

bool IsPosition(const Json& row) {
  return row.is_array() && row.size() == 3 &&
         std::ranges::all_of(row, [](const Json& x) { return x.is_number(); }) &&
         json_parts::VecFromJson(row, 0).allFinite();
}

std::array<double, 3> ReadPosition(const Json& point) {
  const auto row = point.find("position");
  if (row == point.end() || !IsPosition(*row)) {
    throw IoError(fmt::format(
        "'position' is {}; it must be [x, y, z], finite numbers; place the point in Slicer, or "
        "mark it as missing there",
        row == point.end() ? "missing" : row->dump()));
  }
  const Vec3 p = json_parts::VecFromJson(*row, 0);
  return {p.x(), p.y(), p.z()};
}

void AddPoint(const Json& point, LandmarkFile& file) {
  if (!point.is_object()) {
    throw IoError("'controlPoints' must list objects");
  }
  Landmark landmark;
  landmark.site = ReadText(point, "label", "");
  const std::string status = ReadText(point, "positionStatus", "defined");
  if (const std::string reason = AbsenceReason(status); !reason.empty()) {
    file.absent.push_back({landmark.site, reason});
    return;
  }
  landmark.point = ReadPosition(point);
  landmark.note = ReadText(point, "description", "");
  file.landmarks.push_back(landmark);
}

// "point 3 'nasion'"; numbers begin with 1.
std::string PointLabel(const Json& point, std::size_t number) {
  const bool has_label = point.is_object() && point.contains("label") && point["label"].is_string();
  return has_label ? fmt::format("point {} '{}'", number, point["label"].get<std::string>())
                   : fmt::format("point {}", number);
}

void AddPoints(const Json& markup, LandmarkFile& file) {
  std::size_t number = 0;
  for (const Json& point : json_parts::ListFromJson(markup, "controlPoints")) {
    ++number;
    try {
      AddPoint(point, file);
    } catch (const IoError& error) {
      throw IoError(fmt::format("{}: {}", PointLabel(point, number), error.what()));
    }
  }
}

// True for a point whose `visibility` or `selected` is false.
bool IsHidden(const Json& point) {
  return std::ranges::any_of(std::array{"visibility", "selected"}, [&](const char* key) {
    const auto found = point.find(key);
    return found != point.end() && found->is_boolean() && !found->get<bool>();
  });
}

// The labels of the control points; of those that have none, nothing.
std::vector<std::string> ListLabels(const Json& markup, bool (*wanted)(const Json& point)) {
  std::vector<std::string> labels;
  const auto points = markup.find("controlPoints");
  for (const Json& point : points == markup.end() ? Json::array() : *points) {
    if (point.is_object() && wanted(point)) {
      labels.push_back(ReadText(point, "label", ""));
    }
  }
  return labels;
}

void NoteLeftOut(std::string_view file, const std::string& type, const Json& markup,
                 std::vector<std::string>& notes) {
  constexpr std::size_t kMostLabels = 5;
  std::vector<std::string> labels = ListLabels(markup, [](const Json&) { return true; });
  const std::size_t count = labels.size();
  labels.resize(std::min(count, kMostLabels));
  notes.push_back(
      fmt::format("{}: left out a markup of type {} with {} points ({}{}); only the points of type "
                  "Fiducial are "
                  "landmarks",
                  file, type, count, fmt::join(labels, ", "), count > kMostLabels ? ", ..." : ""));
}

LandmarkFile FromJson(const Json& json, std::string_view name, std::vector<std::string>& notes) {
  LandmarkFile file{.subject = "", .units = "mm", .axes = "", .landmarks = {}, .absent = {}};
  for (const Json& markup : json_parts::ListFromJson(json, "markups")) {
    if (const std::string type = ReadText(markup, "type", "Fiducial"); type != "Fiducial") {
      NoteLeftOut(name, type, markup, notes);
      continue;
    }
    const std::string axes = ReadAxes(markup);
    if (!file.axes.empty() && file.axes != axes) {
      throw IoError("its markups have different axes; export them one by one");
    }
    file.axes = axes;
    RequireMillimetres(markup);
    AddPoints(markup, file);
    NoteHidden(name, ListLabels(markup, &IsHidden), notes);
  }
  return file;
}

Json PointJson(const Landmark& landmark, std::size_t number) {
  Json point;
  point["id"] = std::to_string(number);
  point["label"] = landmark.site;
  point["description"] = landmark.note;
  point["position"] = landmark.point;
  point["positionStatus"] = "defined";
  return point;
}

}  // namespace

LandmarkFile ParseMarkupsJson(std::string_view text, std::string_view file,
                              std::vector<std::string>& notes) {
  try {
    return FromJson(json_parts::ParseWithoutRepeats(text), file, notes);
  } catch (const nlohmann::json::exception& error) {
    throw IoError(fmt::format("{}: {}", file, JsonFault(error)));
  } catch (const IoError& error) {
    throw IoError(fmt::format("{}: {}", file, error.what()));
  }
}

std::string MarkupsJson(const LandmarkFile& file) {
  Json points = Json::array();
  for (const Landmark& landmark : file.landmarks) {
    points.push_back(PointJson(landmark, points.size() + 1));
  }
  Json markup;
  markup["type"] = "Fiducial";
  markup["coordinateSystem"] = "LPS";
  markup["coordinateUnits"] = "mm";
  markup["controlPoints"] = points;
  Json json;
  json["@schema"] =
      "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/"
      "Schema/markups-schema-v1.0.3.json#";
  json["markups"] = Json::array({markup});
  return json.dump(2) + "\n";
}

}  // namespace semblance::problems
