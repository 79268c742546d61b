// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_json.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>

#include "surfaces/error.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kFormat = "semblance-hspline";
constexpr int kVersion = 1;

template <class Enum>
Enum EnumFromName(const std::string& name) {
  const auto names = EnumNames(Enum{});
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    throw IoError(fmt::format("'{}' is not one of {}", name, fmt::join(names, ", ")));
  }
  return static_cast<Enum>(found - names.begin());
}

void RequireKeys(const Json& json) {
  const std::set<std::string> wanted = {"format",    "version", "patches",
                                        "max_level", "closure", "offset_reference",
                                        "units",     "level0",  "offsets"};
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

void RequireFormat(const Json& json) {
  if (json.at("format") != kFormat || json.at("version") != kVersion || json.at("units") != "mm") {
    throw IoError(fmt::format("it is {} version {} in {}; only {} version {} in mm can be read",
                              json.at("format").dump(), json.at("version").dump(),
                              json.at("units").dump(), kFormat, kVersion));
  }
}

void RequireSize(const Json& row, std::size_t size) {
  if (!row.is_array() || row.size() != size) {
    throw IoError(fmt::format("{} is not a list of {} numbers", row.dump(), size));
  }
}

HSplineShape ShapeFromJson(const Json& json) {
  RequireSize(json.at("patches"), 2);
  HSplineShape shape;
  shape.patches_u = json.at("patches")[0].get<int>();
  shape.patches_v = json.at("patches")[1].get<int>();
  shape.max_level = json.at("max_level").get<int>();
  shape.closure = EnumFromName<Closure>(json.at("closure").get<std::string>());
  shape.reference = EnumFromName<OffsetReference>(json.at("offset_reference").get<std::string>());
  return shape;
}

Vec3 VecFromJson(const Json& row, std::size_t first) {
  return {row.at(first).get<double>(), row.at(first + 1).get<double>(),
          row.at(first + 2).get<double>()};
}

HSplineSurface SurfaceFromJson(const Json& json) {
  RequireKeys(json);
  RequireFormat(json);
  const HSplineShape shape = ShapeFromJson(json);
  ControlNet net{shape.Columns(0), shape.Rows(0), {}};
  for (const Json& row : json.at("level0")) {
    RequireSize(row, 3);
    net.vertices.push_back(VecFromJson(row, 0));
  }
  std::map<VertexId, std::optional<Vec3>> offsets;
  for (const Json& row : json.at("offsets")) {
    RequireSize(row, 6);
    const VertexId vertex{row[0].get<int>(), row[1].get<int>(), row[2].get<int>()};
    if (!offsets.emplace(vertex, VecFromJson(row, 3)).second) {
      throw IoError(fmt::format("vertex ({}, {}) of level {} has two offsets", vertex.i, vertex.j,
                                vertex.level));
    }
  }
  HSplineSurface surface(shape, std::move(net));
  surface.SetOffsets(offsets);
  return surface;
}

}  // namespace

std::string HSplineToJson(const HSplineSurface& surface) {
  const HSplineShape& shape = surface.shape();
  Json json;
  json["format"] = kFormat;
  json["version"] = kVersion;
  json["units"] = "mm";
  json["patches"] = {shape.patches_u, shape.patches_v};
  json["max_level"] = shape.max_level;
  json["closure"] = EnumNames(shape.closure)[static_cast<int>(shape.closure)];
  json["offset_reference"] = EnumNames(shape.reference)[static_cast<int>(shape.reference)];
  json["level0"] = Json::array();
  for (const Vec3& p : surface.Net(0).vertices) {
    json["level0"].push_back({p.x(), p.y(), p.z()});
  }
  json["offsets"] = Json::array();
  for (const auto& [vertex, o] : surface.Offsets()) {
    json["offsets"].push_back({vertex.level, vertex.i, vertex.j, o.x(), o.y(), o.z()});
  }
  return json.dump() + "\n";
}

HSplineSurface HSplineFromJson(std::string_view text, const std::string& name) {
  try {
    return SurfaceFromJson(Json::parse(text));
  } catch (const nlohmann::json::exception& e) {
    throw IoError(fmt::format("{}: not an H-spline that can be read: {}", name, e.what()));
  } catch (const Error& e) {
    throw IoError(fmt::format("{}: not an H-spline that can be read: {}", name, e.what()));
  }
}

}  // namespace semblance
