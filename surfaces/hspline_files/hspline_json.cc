// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_files/hspline_json.h"

#include <fmt/format.h>

#include <algorithm>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"
#include "surfaces/hspline_files/json_parts.h"

namespace semblance {
namespace {

using namespace json_parts;

constexpr std::string_view kHSplineFormat = "semblance-hspline";
constexpr int kHSplineVersion = 1;

HSplineSurface SurfaceFromJson(const Json& json) {
  RequireKeys(json, {"format", "version", "patches", "max_level", "closure", "offset_reference",
                     "units", "level0", "offsets"});
  RequireFormat(json, kHSplineFormat, kHSplineVersion);
  const HSplineShape shape = ShapeFromJson(json);
  ControlNet net{shape.Columns(0), shape.Rows(0), {}};
  for (const Json& row : ListFromJson(json, "level0")) {
    RequireSize(row, 3);
    net.vertices.push_back(VecFromJson(row, 0));
  }
  std::map<VertexId, std::optional<Vec3>> offsets;
  for (const auto& [vertex, offset] : OffsetsFromJson(json)) {
    offsets.emplace(vertex, offset);
  }
  HSplineSurface surface(shape, std::move(net));
  surface.SetOffsets(offsets);
  return surface;
}

}  // namespace

void CheckFinite(const HSplineSurface& surface) {
  const ControlNet level0 = surface.Net(0);
  bool finite = std::ranges::all_of(level0.vertices, [](const Vec3& p) { return p.allFinite(); });
  for (const auto& [vertex, offset] : surface.Offsets()) {
    finite = finite && offset.allFinite();
  }
  if (!finite) {
    throw InputError(
        "H-spline: a vertex is at no finite place, so it cannot be written; look for huge numbers "
        "in what it was made from");
  }
}

std::string HSplineToJson(const HSplineSurface& surface) {
  CheckFinite(surface);
  const HSplineShape& shape = surface.shape();
  Json json;
  json["format"] = kHSplineFormat;
  json["version"] = kHSplineVersion;
  json["units"] = "mm";
  ShapeToJson(shape, json);
  json["level0"] = Json::array();
  const ControlNet level0 = surface.Net(0);
  for (const Vec3& p : level0.vertices) {
    json["level0"].push_back({p.x(), p.y(), p.z()});
  }
  json["offsets"] = OffsetsToJson(surface.Offsets());
  return json.dump() + "\n";
}

HSplineSurface HSplineFromJson(std::string_view text, const std::string& name) {
  const std::size_t start = text.find_first_not_of(" \t\r\n");
  if (start == text.npos || text[start] != '{') {
    throw IoError(
        fmt::format("{}: not an H-spline: it is no JSON object; an H-spline is a file such as "
                    "face.hspline.json of a run, or surface.hspline.json of a fit",
                    name));
  }
  try {
    return SurfaceFromJson(ParseWithoutRepeats(text));
  } catch (const nlohmann::json::exception& e) {
    throw IoError(fmt::format("{}: not an H-spline that can be read: {}", name, JsonFault(e)));
  } catch (const Error& e) {
    throw IoError(fmt::format("{}: not an H-spline that can be read: {}", name, e.what()));
  }
}

void WriteHSpline(const std::filesystem::path& path, const HSplineSurface& surface) {
  WriteFileAtomically(path, HSplineToJson(surface));
}

HSplineSurface ReadHSpline(const std::filesystem::path& path) {
  return HSplineFromJson(ReadFileBytes(path), path.string());
}

}  // namespace semblance
