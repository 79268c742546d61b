// SPDX-License-Identifier: GPL-3.0-or-later
// Text to JSON, within the depth that a recursion over the tree can stand.
#pragma once

#include <exception>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace semblance {

inline constexpr int kDeepestJson = 64;  // levels of lists and objects within each other

// Throws IoError for deeper nesting, and for an object of over 4,000 entries; JSON or not.
void CheckJsonDepth(std::string_view text);

// Throws IoError, which begins with `name`, for deeper nesting and for what is no JSON.
nlohmann::ordered_json ParseJson(std::string_view text, std::string_view name);

// What an exception of the JSON library says, for people: without its own name and number.
std::string JsonFault(const std::exception& error);

}  // namespace semblance
