// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/json_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>

#include "surfaces/base/error.h"

namespace semblance {

// Brackets outside of texts, counted before the parser builds a tree of them.
void CheckJsonDepth(std::string_view text) {
  int depth = 0;
  bool is_in_text = false;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char c = text[k];
    if (is_in_text) {
      k += c == '\\' ? 1 : 0;  // what is escaped ends nothing
      is_in_text = c != '"';
    } else if (c == '"') {
      is_in_text = true;
    } else if (c == '[' || c == '{') {
      ++depth;
    } else if (c == ']' || c == '}') {
      --depth;
    }
    if (depth > kDeepestJson) {
      throw IoError(
          fmt::format("more than {} levels of lists and objects within each other", kDeepestJson));
    }
  }
}

std::string JsonFault(const std::exception& error) {
  const std::string_view words = error.what();
  const std::size_t end = words.starts_with("[json.exception.") ? words.find("] ") : words.npos;
  return std::string(end == words.npos ? words : words.substr(end + 2));
}

nlohmann::ordered_json ParseJson(std::string_view text, std::string_view name) {
  try {
    CheckJsonDepth(text);
    return nlohmann::ordered_json::parse(text);
  } catch (const nlohmann::json::exception& error) {
    throw IoError(fmt::format("{}: this is not JSON: {}", name, JsonFault(error)));
  } catch (const IoError& error) {
    throw IoError(fmt::format("{}: {}", name, error.what()));
  }
}

}  // namespace semblance
