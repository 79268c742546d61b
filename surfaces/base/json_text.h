// SPDX-License-Identifier: GPL-3.0-or-later
// Parses JSON with limits on depth and size, so that recursion over the tree cannot overflow the
// stack.
#pragma once

#include <exception>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace semblance {

inline constexpr int kDeepestJson = 64;  // nested lists and objects

// Throws IoError for deeper nesting, and for an object of more than 4,000 entries. The text need
// not be valid JSON.
void CheckJsonDepth(std::string_view text);

// Throws IoError, beginning with `name`, for deeper nesting and for invalid JSON.
nlohmann::ordered_json ParseJson(std::string_view text, std::string_view name);

// The message of a JSON library exception, without the exception's own name and number.
std::string JsonFault(const std::exception& error);

}  // namespace semblance
