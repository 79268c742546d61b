// SPDX-License-Identifier: GPL-3.0-or-later
// What the JSON files of H-splines and of their features have in common. All throw IoError with the
// end of a sentence, to which the caller adds the name of the file.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance::json_parts {

using Json = nlohmann::ordered_json;

// The JSON library keeps one of several entries of the same name, silently; this refuses them.
Json ParseWithoutRepeats(std::string_view text);

// An object with exactly these entries.
void RequireKeys(const Json& json, const std::set<std::string>& wanted);

// Entries format, version and units (mm).
void RequireFormat(const Json& json, std::string_view format, int version);

void RequireSize(const Json& row, std::size_t size);
int IntFromJson(const Json& number);
const Json& ListFromJson(const Json& json, const char* key);
Vec3 VecFromJson(const Json& row, std::size_t first);

// Entries patches, max_level, closure, offset_reference.
HSplineShape ShapeFromJson(const Json& json);
void ShapeToJson(const HSplineShape& shape, Json& json);

// Entry offsets: [[level, i, j, x, y, z], ...] in order.
std::map<VertexId, Vec3> OffsetsFromJson(const Json& json);
Json OffsetsToJson(const std::map<VertexId, Vec3>& offsets);

}  // namespace semblance::json_parts
