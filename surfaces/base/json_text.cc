// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/json_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "surfaces/base/error.h"

namespace semblance {
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

}  // namespace semblance
