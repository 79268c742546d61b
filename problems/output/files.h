// SPDX-License-Identifier: GPL-3.0-or-later
// The folder a run writes.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/base/atomic_file.h"

namespace semblance {

// What to do with a folder that already holds something. kReplaceFiles overwrites files of the same
// name, one by one, and deletes nothing.
enum class WhenNotEmpty { kRefuse, kReplaceFiles };

// In a folder while its files are put there; what a killed process leaves of it says that they are
// not all there (staged_folder.h).
inline constexpr const char* kUnfinishedPart = ".semblance-part";

// The folder of one run. Constructing it creates the folder (with its parents) and tries out that a
// file can be written there, so that a wrong folder is known before any long work.
class OutputFolder {
 public:
  // Throws IoError if `root` is not a folder, cannot be created or written to, or holds something
  // under kRefuse.
  OutputFolder(std::filesystem::path root, WhenNotEmpty when_not_empty);

  const std::filesystem::path& Root() const { return root_; }

  // The names that Write has written, in that order.
  const std::vector<std::string>& Written() const { return written_; }

  // Root() / name, e.g. "pictures/front.png"; the folders in between are created. Throws InputError
  // if `name` is empty, absolute or leads out of the folder, IoError if a folder cannot be created.
  std::filesystem::path PathOf(std::string_view name) const;

  // WriteFileAtomically(PathOf(name), bytes, durability).
  void Write(std::string_view name, std::string_view bytes,
             Durability durability = Durability::kSynced);

 private:
  std::vector<std::string> written_;
  std::filesystem::path root_;
};

// Of a file or folder without its endings: `head` of head.nii.gz, head.ply and head/.
std::string PlainName(const std::filesystem::path& path);

}  // namespace semblance
