// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/read_parts.h"

#include <algorithm>

namespace semblance {

void AppendFan(std::span<const std::int32_t> corners, std::vector<Triangle>& triangles) {
  for (std::size_t c = 2; c < corners.size(); ++c) {
    triangles.push_back({corners[0], corners[c - 1], corners[c]});
  }
}

std::string Shown(std::string_view piece) {
  constexpr std::size_t kLongest = 40;
  std::string shown(piece.substr(0, kLongest));
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return piece.size() > kLongest ? shown + "..." : shown;
}

bool IsPadding(std::string_view bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\0';
  });
}

}  // namespace semblance
