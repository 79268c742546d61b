// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_files/json_parts.h"

#include <fmt/format.h>

#include <algorithm>

#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"

namespace semblance::json_parts {
namespace {

template <class Enum>
Enum EnumFromName(const std::string& name) {
  const auto names = EnumNames(Enum{});
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    throw IoError(fmt::format("'{}' is not one of {}", name, fmt::join(names, ", ")));
  }
  return static_cast<Enum>(found - names.begin());
}

double DoubleFromJson(const Json& number) {
  if (!number.is_number()) {
    throw IoError(fmt::format("{} is not a number", number.dump()));
  }
  return number.get<double>();
}

}  // namespace

// The JSON library keeps one of several entries of the same name, silently.
Json ParseWithoutRepeats(std::string_view text) {
  std::set<std::string> seen;
  CheckJsonDepth(text);
  return Json::parse(text, [&seen](int depth, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::key && depth == 1 &&
        !seen.insert(parsed.get<std::string>()).second) {
      throw IoError(fmt::format("entry '{}' appears twice", parsed.get<std::string>()));
    }
    return true;  // keep it
  });
}

void RequireKeys(const Json& json, const std::set<std::string>& wanted) {
  if (!json.is_object()) {
    throw IoError("the top is not an object");
  }
  for (const auto& [key, value] : json.items()) {
    if (!wanted.contains(key)) {
      throw IoError(fmt::format("unknown entry '{}'; known are {}", key, fmt::join(wanted, ", ")));
    }
  }
  for (const std::string& key : wanted) {
    if (!json.contains(key)) {
      throw IoError(fmt::format("entry '{}' is missing", key));
    }
  }
}

void RequireFormat(const Json& json, std::string_view format, int version) {
  if (json.at("format") != format || json.at("version") != version || json.at("units") != "mm") {
    throw IoError(fmt::format("it is {} version {} in {}; only {} version {} in mm can be read",
                              json.at("format").dump(), json.at("version").dump(),
                              json.at("units").dump(), format, version));
  }
}

void RequireSize(const Json& row, std::size_t size) {
  if (!row.is_array() || row.size() != size) {
    throw IoError(fmt::format("{} is not a list of {} numbers", row.dump(), size));
  }
}

int IntFromJson(const Json& number) {
  constexpr int kMost = 1'000'000;  // far above all that is allowed anywhere, safe to reckon with
  if (!number.is_number_integer() || number < -kMost || number > kMost) {
    throw IoError(fmt::format("{} is not a whole number of a sensible size", number.dump()));
  }
  return number.get<int>();
}

const Json& ListFromJson(const Json& json, const char* key) {
  if (!json.at(key).is_array()) {
    throw IoError(fmt::format("'{}' is not a list", key));
  }
  return json.at(key);
}

Vec3 VecFromJson(const Json& row, std::size_t first) {
  return {DoubleFromJson(row.at(first)), DoubleFromJson(row.at(first + 1)),
          DoubleFromJson(row.at(first + 2))};
}

HSplineShape ShapeFromJson(const Json& json) {
  RequireSize(json.at("patches"), 2);
  HSplineShape shape;
  shape.patches_u = IntFromJson(json.at("patches")[0]);
  shape.patches_v = IntFromJson(json.at("patches")[1]);
  shape.max_level = IntFromJson(json.at("max_level"));
  shape.closure = EnumFromName<Closure>(json.at("closure").get<std::string>());
  shape.reference = EnumFromName<OffsetReference>(json.at("offset_reference").get<std::string>());
  return shape;
}

void ShapeToJson(const HSplineShape& shape, Json& json) {
  json["patches"] = {shape.patches_u, shape.patches_v};
  json["max_level"] = shape.max_level;
  json["closure"] = EnumNames(shape.closure)[static_cast<int>(shape.closure)];
  json["offset_reference"] = EnumNames(shape.reference)[static_cast<int>(shape.reference)];
}

std::map<VertexId, Vec3> OffsetsFromJson(const Json& json) {
  std::map<VertexId, Vec3> offsets;
  for (const Json& row : ListFromJson(json, "offsets")) {
    RequireSize(row, 6);
    const VertexId vertex{IntFromJson(row[0]), IntFromJson(row[1]), IntFromJson(row[2])};
    if (!offsets.emplace(vertex, VecFromJson(row, 3)).second) {
      throw IoError(fmt::format("vertex ({}, {}) of level {} has two offsets", vertex.i, vertex.j,
                                vertex.level));
    }
  }
  return offsets;
}

Json OffsetsToJson(const std::map<VertexId, Vec3>& offsets) {
  Json rows = Json::array();
  for (const auto& [vertex, o] : offsets) {
    rows.push_back({vertex.level, vertex.i, vertex.j, o.x(), o.y(), o.z()});
  }
  return rows;
}

}  // namespace semblance::json_parts
