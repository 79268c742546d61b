// SPDX-License-Identifier: GPL-3.0-or-later
// Existing files that a job must treat with care: its input files, which no output may replace, and
// the outputs of an earlier job of the same kind, which must not pass for outputs of this job.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace semblance::problems {

// Identifies an output file of this program that no manifest names.
struct FileMark {
  const char* name = "";        // a regular expression
  std::string_view words = {};  // text in the file's first 64 KiB
};

struct GivenFiles {
  // Input files. Empty names, and "-", stand for no file.
  std::vector<std::filesystem::path> files;
  // Names of the files that the job may write, relative to its folder; * stands for any characters.
  // They serve to refuse a job before its work; StagedFolder protects all input files, whatever
  // their names.
  std::span<const std::string_view> outputs = {};
  // Marks of outputs that the job does not write each time; see OldFiles.
  std::span<const FileMark> marks = {};
};

// True if `name` matches one of the outputs.
bool IsAmong(std::span<const std::string_view> outputs, std::string_view name);

// True if writing `out` would replace one of the files, by this name or another: links are
// followed.
bool IsAnyOf(std::span<const std::filesystem::path> given, const std::filesystem::path& out);

// Throws InputError if writing `out` would replace one of the files.
void RefuseToReplace(const std::filesystem::path& out,
                     std::span<const std::filesystem::path> given);

// Throws IoError if a file or folder of that name exists, unless `force` permits to replace it.
void RefuseExisting(const std::filesystem::path& out, bool force);

// Throws InputError if one of the outputs in `folder` is one of the files.
void RefuseToReplace(const std::filesystem::path& folder, const GivenFiles& given);

// Finds the outputs of an earlier job of the same kind in `folder`; returns their names relative to
// `folder`. These are the files that match `job.outputs`, are named by manifest.json, and still
// have the hash in it; and the files with one of the job's marks. Excludes the files in `written`,
// and the input files. Files of another origin are never among them, whatever their names.
std::vector<std::string> OldFiles(const std::filesystem::path& folder, const GivenFiles& job,
                                  const std::vector<std::filesystem::path>& written);

// Removes the files, and folders that become empty.
void RemoveFiles(const std::filesystem::path& folder, const std::vector<std::string>& names);

}  // namespace semblance::problems
