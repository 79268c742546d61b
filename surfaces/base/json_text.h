// SPDX-License-Identifier: GPL-3.0-or-later
// Parses JSON with limits on depth and size, so that recursion over the tree cannot overflow the
// stack.
#pragma once

#include <exception>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <string_view>

#include "surfaces/base/geometry.h"

namespace semblance::surfaces {

inline constexpr int kDeepestJson = 64;  // nested lists and objects

// Throws IoError for deeper nesting, and for an object of more than 4,000 entries. The text need
// not be valid JSON.
void CheckJsonDepth(std::string_view text);

// Throws IoError, beginning with `name`, for deeper nesting and for invalid JSON.
nlohmann::ordered_json ParseJson(std::string_view text, std::string_view name);

// The message of a JSON library exception, without the exception's own name and number.
std::string JsonFault(const std::exception& error);

}  // namespace semblance::surfaces

// Parts of strict readers of JSON files. All throw IoError with the end of a sentence, to which the
// caller adds the file's name.
namespace semblance::surfaces::json_parts {

using Json = nlohmann::ordered_json;

// Parses the text and refuses an object at the top that repeats an entry. (The JSON library would
// silently keep one of the two.)
Json ParseWithoutRepeats(std::string_view text);

// Requires an object with exactly these entries.
void RequireKeys(const Json& json, const std::set<std::string>& wanted);

// Requires the entries `format`, `version` and `units` ("mm").
void RequireFormat(const Json& json, std::string_view format, int version);

// Requires a list of `size` entries.
void RequireSize(const Json& row, std::size_t size);
int IntFromJson(const Json& number);
const Json& ListFromJson(const Json& json, const char* key);
// Reads the three numbers row[first], row[first + 1] and row[first + 2].
Vec3 VecFromJson(const Json& row, std::size_t first);

}  // namespace semblance::surfaces::json_parts
