// SPDX-License-Identifier: GPL-3.0-or-later
// The folder that a run writes its files into.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/base/atomic_file.h"

namespace semblance::problems {

// The treatment of an output folder that is not empty. kReplaceFiles overwrites files of the same
// name, one by one, and deletes nothing.
enum class WhenNotEmpty { kRefuse, kReplaceFiles };

// Name of the staging folder (staged_folder.h), which exists while files are moved into its parent.
// If a killed process leaves it, some of these files are missing.
inline constexpr const char* kUnfinishedPart = ".semblance-part";

// The constructor creates the folder (with its parents) and tests whether a file can be written
// there, so that a wrong folder is reported before any long work.
class OutputFolder {
 public:
  // Throws IoError if `root` is not a folder, cannot be created or written to, or holds something
  // under kRefuse.
  OutputFolder(std::filesystem::path root, WhenNotEmpty when_not_empty);

  const std::filesystem::path& Root() const { return root_; }

  // The names of the written files, in the order of writing.
  const std::vector<std::string>& Written() const { return written_; }

  // Returns Root() / name, e.g. for "pictures/front.png"; creates the folders in between. Throws
  // InputError if `name` is empty, absolute or leads out of the folder, IoError like
  // MakeFolderBelow.
  std::filesystem::path MakePath(std::string_view name) const;

  // WriteFileAtomically(MakePath(name), bytes, durability).
  void Write(std::string_view name, std::string_view bytes,
             Durability durability = Durability::kSynced);

 private:
  std::vector<std::string> written_;
  std::filesystem::path root_;
};

// Throws IoError if a folder on the way from `root` to `root / name` is a link, because somebody
// else may have put it there to lead files elsewhere. `root` itself may be a link: the user named
// it. `name` is relative and has no "..".
void RefuseLinksBelow(const std::filesystem::path& root, const std::filesystem::path& name);

// Creates the folder `root / name` with its parents and returns it. Throws IoError like
// RefuseLinksBelow, or if a folder cannot be created.
std::filesystem::path MakeFolderBelow(const std::filesystem::path& root,
                                      const std::filesystem::path& name);

// The name of a file or folder without its endings: `head` for head.nii.gz, head.ply and head/.
std::string PlainName(const std::filesystem::path& path);

}  // namespace semblance::problems
