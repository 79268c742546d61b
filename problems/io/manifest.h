// SPDX-License-Identifier: GPL-3.0-or-later
// The program that makes a result, and the versions of its parts, for manifest.json, trial.json and
// the key of the cache.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace semblance::problems {

// Name and version of each library that has a part in a result, and of the compiler.
std::vector<std::pair<std::string, std::string>> LibraryVersions();

// SHA-256 of the file with this code: the program, or the Python module. Another build of the same
// version may compute other bits.
const std::string& ProgramHash();

}  // namespace semblance::problems
