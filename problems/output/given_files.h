// SPDX-License-Identifier: GPL-3.0-or-later
// Files that a job was given to read, which nothing that it writes may replace.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace semblance {

// How a file that the program wrote is known where no manifest names it.
struct FileMark {
  const char* name = "";        // a regular expression
  std::string_view words = {};  // that stand in its first 64 KiB
};

struct GivenFiles {
  // Empty names, and "-", stand for no file.
  std::vector<std::filesystem::path> files;
  // What the job may write into its folder, relative to it; * stands for any characters. For the
  // refusal before the work: StagedFolder replaces no given file, whatever its name.
  std::span<const std::string_view> outputs = {};
  // Of outputs that are not written each time (old_files.h).
  std::span<const FileMark> marks = {};
};

// Whether `name` is one of the outputs.
bool IsAmong(std::span<const std::string_view> outputs, std::string_view name);

// Whether writing `out` would replace one of the files, by this name or another: links are
// followed.
bool IsOneOf(std::span<const std::filesystem::path> given, const std::filesystem::path& out);

// Throws InputError if it would.
void RefuseToReplace(const std::filesystem::path& out,
                     std::span<const std::filesystem::path> given);

// Throws IoError if there is a file or folder of that name and no `force` to replace it.
void RefuseExisting(const std::filesystem::path& out, bool force);

// Throws InputError if one of the outputs in `folder` is one of the files.
void RefuseToReplace(const std::filesystem::path& folder, const GivenFiles& given);

}  // namespace semblance
