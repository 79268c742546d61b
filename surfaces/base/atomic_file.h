// SPDX-License-Identifier: GPL-3.0-or-later
// Whole files: reads them at once, and writes them so that a reader finds either the old or the new
// file, never half of one.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/base/layers.h"

namespace semblance::surfaces {

// kSynced files survive a power failure. kUnsynced files survive the end of the process, but may be
// empty after a power failure. kUnsynced saves two waits for the disk. Use it for files that are
// verified when they are read and can be computed again.
enum class Durability { kSynced, kUnsynced };

// Writes `bytes` to a temporary file in the folder of `path`, syncs it, and renames it to `path`.
// The temporary file is new and has a random name (".semblance-", 16 hexadecimal digits, ".tmp"),
// so a link or file that somebody has put into a shared folder is never opened for writing. If
// `path` itself is a link, the rename replaces the link, and the file behind it stays as it is. On
// failure throws IoError with the path and the system's reason; then `path` is unchanged and no
// temporary file remains.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes,
                         Durability durability = Durability::kSynced);

struct FileBytes {
  std::filesystem::path path;
  std::string bytes;
};

// Writes all files like WriteFileAtomically. If one of them cannot be written, for example on a
// full disk, none changes.
void WriteFilesTogether(std::span<const FileBytes> files);

// Makes a folder with its parents. The destructor removes the folders that were made, as far as
// they are empty, unless Keep was called: a command that refuses its input leaves nothing behind.
class NewFolders {
 public:
  // Throws IoError.
  explicit NewFolders(const std::filesystem::path& folder);
  ~NewFolders();
  NewFolders(const NewFolders&) = delete;
  NewFolders& operator=(const NewFolders&) = delete;

  void Keep() { made_.clear(); }

 private:
  void Remove();

  std::vector<std::filesystem::path> made_;  // outermost first
};

// Reads the whole file. Throws IoError with the path and the reason: no such file, a folder, or the
// system's reason.
std::string ReadFileBytes(const std::filesystem::path& path);

// Creates and removes a temporary file in `folder`. Returns the system's reason if this fails, else
// "".
std::string FindWritingFault(const std::filesystem::path& folder);

// Removes the temporary files that killed processes left directly in `folder`. A file that a living
// process still writes is locked (flock) and stays. All other files stay.
void SweepTemporaryFiles(const std::filesystem::path& folder);

// Makes renames in `folder` survive a power failure, if the file system supports it.
void SyncFolder(const std::filesystem::path& folder);

}  // namespace semblance::surfaces
