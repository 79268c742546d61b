// SPDX-License-Identifier: GPL-3.0-or-later
// The files that the program carries for the workbench. CMake embeds their text.
#pragma once

#include <span>
#include <string_view>

namespace semblance::problems {

struct BenchAsset {
  std::string_view name;  // e.g. "main.js", "tables/rhine_caucasoid.yaml"
  std::string_view text;
};

std::span<const BenchAsset> PageFiles();     // of problems/page
std::span<const BenchAsset> StarterFiles();  // depth tables and the depth marker network

}  // namespace semblance::problems
