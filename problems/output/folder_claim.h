// SPDX-License-Identifier: GPL-3.0-or-later
// A folder that one process has for itself while it lives.
#pragma once

#include <filesystem>
#include <string>

namespace semblance {

// Holds a lock on a folder of the program's own. The system takes the lock back when the process
// ends, however it ends.
class FolderClaim {
 public:
  FolderClaim() = default;
  ~FolderClaim() { Release(); }
  FolderClaim(const FolderClaim&) = delete;
  FolderClaim& operator=(const FolderClaim&) = delete;

  // Makes `folder`, or takes one over that a dead process has left, and clears it. `what`: what
  // messages call the thing that is claimed. Throws IoError if another process has it, or if it
  // cannot be made. Where the file system has no locks, a folder that is there is taken for another
  // process's.
  void Take(const std::filesystem::path& folder, const std::string& what);
  void Release();

  const std::filesystem::path& Folder() const { return folder_; }

 private:
  bool TryToLock(bool is_new, const std::string& what);

  std::filesystem::path folder_;
  int descriptor_ = -1;
};

}  // namespace semblance
