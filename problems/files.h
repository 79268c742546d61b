// SPDX-License-Identifier: GPL-3.0-or-later
// Files that are either the old one or the new one, never half of one; and the folder a run writes.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace semblance {

// Writes a temporary file beside `path`, syncs it, and renames it to `path`, which then holds
// exactly `bytes`. On failure throws IoError with the path and the system's reason; `path` is then
// as it was, and no temporary file is left.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes);

// The whole file. Throws IoError if it cannot be read.
std::string ReadFileBytes(const std::filesystem::path& path);

// What to do with a folder that already holds something. kReplaceFiles overwrites files of the same
// name, one by one, and deletes nothing.
enum class WhenNotEmpty { kRefuse, kReplaceFiles };

// The folder of one run. Constructing it creates the folder (with its parents) and tries out that a
// file can be written there, so that a wrong folder is known before any long work.
class OutputFolder {
 public:
  // Throws IoError if `root` is not a folder, cannot be created or written to, or holds something
  // under kRefuse.
  OutputFolder(std::filesystem::path root, WhenNotEmpty when_not_empty);

  const std::filesystem::path& Root() const { return root_; }

  // Root() / name, e.g. "pictures/front.png"; the folders in between are created. Throws InputError
  // if `name` is empty, absolute or leads out of the folder, IoError if a folder cannot be created.
  std::filesystem::path PathOf(std::string_view name) const;

  // WriteFileAtomically(PathOf(name), bytes).
  void Write(std::string_view name, std::string_view bytes) const;

 private:
  std::filesystem::path root_;
};

}  // namespace semblance
