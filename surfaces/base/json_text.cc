// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/json_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "surfaces/base/error.h"

namespace semblance::surfaces {
namespace {

// The library compares each new entry of an object with all others, which takes quadratic time.
constexpr int kMaxEntries = 4000;

}  // namespace

// Counts brackets and colons outside of texts, before the parser builds a tree.
void CheckJsonDepth(std::string_view text) {
  std::vector<int> entries = {0};  // count per open list or object
  bool is_in_text = false;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char c = text[k];
    if (is_in_text) {
      k += c == '\\' ? 1 : 0;  // an escaped quote does not end the text
      is_in_text = c != '"';
    } else if (c == '"') {
      is_in_text = true;
    } else if (c == '[' || c == '{') {
      entries.push_back(0);
    } else if ((c == ']' || c == '}') && entries.size() > 1) {
      entries.pop_back();
    } else if (c == ':') {
      ++entries.back();
    }
    if (entries.size() > kDeepestJson + 1) {
      throw IoError(
          fmt::format("more than {} levels of lists and objects within each other", kDeepestJson));
    }
    if (entries.back() > kMaxEntries) {
      throw IoError(fmt::format("an object of more than {} entries", kMaxEntries));
    }
  }
}

std::string JsonFault(const std::exception& error) {
  const std::string_view words = error.what();
  const std::size_t end = words.starts_with("[json.exception.") ? words.find("] ") : words.npos;
  return std::string(end == words.npos ? words : words.substr(end + 2));
}

nlohmann::ordered_json ParseJson(std::string_view text, std::string_view name) {
  // The library takes a zero byte for the end of the text and ignores the rest.
  if (const std::size_t zero = text.find('\0'); zero != text.npos) {
    throw IoError(fmt::format("{}: this is not JSON: byte {} is zero", name, zero + 1));
  }
  try {
    CheckJsonDepth(text);
    return nlohmann::ordered_json::parse(text);
  } catch (const nlohmann::json::exception& error) {
    throw IoError(fmt::format("{}: this is not JSON: {}", name, JsonFault(error)));
  } catch (const IoError& error) {
    throw IoError(fmt::format("{}: {}", name, error.what()));
  }
}

}  // namespace semblance::surfaces

namespace semblance::surfaces::json_parts {
namespace {

double DoubleFromJson(const Json& number) {
  if (!number.is_number()) {
    throw IoError(fmt::format("{} is not a number", number.dump()));
  }
  return number.get<double>();
}

}  // namespace

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
  constexpr int kMaxInt = 1'000'000;  // far above every allowed value, and safe in products
  if (!number.is_number_integer() || number < -kMaxInt || number > kMaxInt) {
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

}  // namespace semblance::surfaces::json_parts
