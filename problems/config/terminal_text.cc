// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/terminal_text.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "problems/config/utf8_check.h"

namespace semblance::problems {
namespace {

std::string ReplaceControls(std::string_view text, std::string_view kept) {
  const auto is_plain = [&](char c) { return (c >= ' ' && c <= '~') || kept.find(c) != kept.npos; };
  if (std::ranges::all_of(text, is_plain)) {
    return std::string(text);
  }
  std::string result;
  for (const Character& c : SplitCharacters(text)) {
    const bool is_kept = c.bytes.size() == 1 && kept.find(c.bytes) != kept.npos;
    result += !is_kept && ControlsText(c.code) ? "?" : c.bytes;
  }
  return result;
}

}  // namespace

std::string ForTerminal(std::string_view text) { return ReplaceControls(text, "\n"); }

std::string PlainText(std::string_view text) { return ReplaceControls(text, "\n\t"); }

nlohmann::ordered_json WithPlainTexts(const nlohmann::ordered_json& json) {
  if (json.is_string()) {
    return PlainText(json.get_ref<const std::string&>());
  }
  if (!json.is_structured()) {
    return json;
  }
  nlohmann::ordered_json plain =
      json.is_array() ? nlohmann::ordered_json::array() : nlohmann::ordered_json::object();
  for (const auto& [key, value] : json.items()) {
    if (json.is_array()) {
      plain.push_back(WithPlainTexts(value));
    } else {
      plain[PlainText(key)] = WithPlainTexts(value);
    }
  }
  return plain;
}

std::string QuotedForShell(std::string_view text) {
  std::string quoted = "'";
  for (const char c : text) {
    quoted += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return quoted + "'";
}

}  // namespace semblance::problems
