// SPDX-License-Identifier: GPL-3.0-or-later
// Versions of the program's parts, for manifest.json.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace semblance::problems {

// Name and version of each library that has a part in a result, and of the compiler.
std::vector<std::pair<std::string, std::string>> LibraryVersions();

}  // namespace semblance::problems
