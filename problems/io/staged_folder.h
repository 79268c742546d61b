// SPDX-License-Identifier: GPL-3.0-or-later
// The output files of one job, which appear together: they are written into a staging folder, and
// moved to their place once all of them are complete.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "problems/io/given_files.h"
#include "problems/io/output_folder.h"

namespace semblance::problems {

// Reserves a folder for this process by a lock. The system releases the lock when the process ends,
// however it ends.
class FolderClaim {
 public:
  FolderClaim() = default;
  ~FolderClaim() { Release(); }
  FolderClaim(const FolderClaim&) = delete;
  FolderClaim& operator=(const FolderClaim&) = delete;

  // Makes `folder`, or takes over one that a dead process has left, and clears it. `what` is the
  // name of the claimed thing in messages. Throws IoError if another process has claimed it, if
  // another user made it, or if it cannot be made. A link of this name is not followed. On a file
  // system without locks an existing folder counts as claimed.
  void Take(const std::filesystem::path& folder, const std::string& what);
  void Release();

  const std::filesystem::path& Folder() const { return folder_; }

 private:
  bool TryToLock(bool is_new, const std::string& what);

  std::filesystem::path folder_;
  int descriptor_ = -1;
};

// There are two places for the staging folder:
// - If `root` is missing or empty, it is ".NAME.semblance-part" in the same parent folder, and is
//   renamed to `root` in one step.
// - If `root` holds files, or if its parent cannot hold the staging folder, it is
//   ".semblance-part" in `root`. Its files are then moved one by one; the file that was written
//   last is moved last. Files of other names stay, except those of an earlier job of the same kind
//   (OldFiles in given_files.h).
//
// As long as this object exists, no other StagedFolder can write `root`. The next one clears what a
// killed process has left.
class StagedFolder {
 public:
  // Throws IoError like OutputFolder, and if another process is writing `root`. Throws InputError
  // like RefuseToReplace, before anything is written.
  StagedFolder(const std::filesystem::path& root, WhenNotEmpty when_not_empty,
               GivenFiles given = {});
  // Deletes the files, and the folders made for them, unless they were published.
  ~StagedFolder();
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;

  const std::filesystem::path& Root() const { return root_; }

  // The staging folder, which is writable until Publish().
  OutputFolder& Files() { return *files_; }

  // Moves all files to Root(). Throws IoError if another program has written there in the meantime,
  // a given file would be replaced, or a file cannot be moved; the files then stay in a folder that
  // the message names.
  void Publish(Durability durability = Durability::kSynced);

 private:
  bool RenameToRoot() const;
  void Undo();
  void MoveFiles();
  void MakeFoldersFor(const std::vector<std::filesystem::path>& files);
  [[noreturn]] void KeepAndFail(const std::string& why);

  std::filesystem::path root_;
  WhenNotEmpty when_not_empty_;
  GivenFiles given_;
  bool is_beside_root_ = false;              // the staging folder; else it is in the root
  std::vector<std::filesystem::path> made_;  // parent folders that were missing, outermost first
  FolderClaim claim_;
  std::optional<OutputFolder> files_;
  bool published_ = false;
};

}  // namespace semblance::problems
