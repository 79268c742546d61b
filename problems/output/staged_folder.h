// SPDX-License-Identifier: GPL-3.0-or-later
// The files of one job, which appear together: they are written into a folder of the program's own,
// and moved to where they belong once all are there.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "problems/output/files.h"
#include "problems/output/folder_claim.h"
#include "problems/output/given_files.h"

namespace semblance {

// Where `root` is missing or empty, the folder of the program's own is ".NAME.semblance-part"
// beside it and takes its name in one step. Where `root` holds something, or where nothing can be
// put beside it, it is ".semblance-part" in `root`, and its files are moved one by one, the one
// that was written last at the end. Files of other names stay, but for those that an earlier job of
// the same kind has left there (old_files.h).
//
// While it lives nobody else writes `root` in this way. What a killed process has left there is
// cleared by the next one.
class StagedFolder {
 public:
  // Throws IoError as OutputFolder does, and if another process is writing `root`; InputError as
  // RefuseToReplace does, before anything is written.
  StagedFolder(const std::filesystem::path& root, WhenNotEmpty when_not_empty,
               GivenFiles given = {});
  // Whatever was not published is gone, and so are folders that were made for it.
  ~StagedFolder();
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;

  const std::filesystem::path& Root() const { return root_; }

  // To write into, until Publish().
  OutputFolder& Files() { return *files_; }

  // Moves all to Root(). Throws IoError if another program has written there meanwhile, a given
  // file would be replaced, or one cannot be moved; the files then stay in a folder that the
  // message names.
  void Publish(Durability durability = Durability::kSynced);

 private:
  bool TakesName() const;
  void Undo();
  void MoveFiles();
  [[noreturn]] void KeepAndFail(const std::string& why);

  std::filesystem::path root_;
  WhenNotEmpty when_not_empty_;
  GivenFiles given_;
  bool beside_ = false;
  std::vector<std::filesystem::path> made_;  // folders above, outermost first
  FolderClaim claim_;
  std::optional<OutputFolder> files_;
  bool published_ = false;
};

}  // namespace semblance
