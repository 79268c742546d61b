// SPDX-License-Identifier: GPL-3.0-or-later
// What the code of a dowel's site says: "go_l" is the gonion on the subject's left.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace semblance {

// Of the subject. kMidline also stands for a code that names no side.
enum class Side : std::uint8_t { kMidline, kLeft, kRight };

// kLeft of "go_l", kRight of "go_r", else kMidline.
Side SideOfSite(std::string_view site);

// "go" of "go_l", "go_r" and "go".
std::string WithoutSide(std::string_view site);

}  // namespace semblance
