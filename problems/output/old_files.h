// SPDX-License-Identifier: GPL-3.0-or-later
// Files that an earlier job of the same kind has left in a folder and that a later one does not
// write: beside its own they would pass for its own.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/output/given_files.h"

namespace semblance {

// Their names, relative to `folder`: those of the job's outputs that manifest.json names and whose
// bytes are still those that it tells, and those with one of the job's marks; but for what is
// `written`, and for files that were given. Files of other origin are none, whatever their names.
std::vector<std::string> OldFiles(const std::filesystem::path& folder, const GivenFiles& job,
                                  const std::vector<std::filesystem::path>& written);

// Folders that are empty then go too.
void RemoveFiles(const std::filesystem::path& folder, const std::vector<std::string>& names);

}  // namespace semblance
