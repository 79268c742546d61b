// SPDX-License-Identifier: GPL-3.0-or-later
// What the readers of mesh files share: limits, polygons as triangles, and words of a file as a
// message may show them.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Of vertices, faces or other elements in one file: what an index of a triangle can name.
inline constexpr std::int64_t kMostElements = 2147483647;

// A polygon as triangles that share its first corner; none if there are fewer than 3.
void AppendFan(std::span<const std::int32_t> corners, std::vector<Triangle>& triangles);

// A piece of a file for a message: at most 40 characters, what cannot be printed as '?'.
std::string Shown(std::string_view piece);

// Whether there is nothing in the bytes but white space and zeros, as some programs pad a file.
bool IsPadding(std::string_view bytes);

}  // namespace semblance
