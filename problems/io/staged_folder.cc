// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/staged_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "problems/io/given_files.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void ThrowCannotCreate(const std::string& what) {
  throw IoError(fmt::format("{}: the folder cannot be created: {}; choose another one", what,
                            std::generic_category().message(errno)));
}

// A folder that another user has prepared stays his: he could replace the files in it at any time.
void RefuseFolderOfOthers(int descriptor, const fs::path& folder, const std::string& what) {
  struct stat open {};
  if (::fstat(descriptor, &open) == 0 && open.st_uid != ::geteuid()) {
    throw IoError(fmt::format(
        "{}: another user of this machine has left {}; ask him to delete it, or choose another "
        "folder",
        what, folder.string()));
  }
}

// True if `folder` is still the name of the open folder: its holder may have renamed it.
bool HasStillName(int descriptor, const fs::path& folder) {
  struct stat open {
  }, named{};
  return ::fstat(descriptor, &open) == 0 && ::lstat(folder.c_str(), &named) == 0 &&
         open.st_ino == named.st_ino && open.st_dev == named.st_dev;
}

void ClearFolder(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code ignored;
    fs::remove_all(at->path(), ignored);
  }
}

constexpr const char* kPart = kUnfinishedPart;

// The absolute path without links, and without a slash at the end.
fs::path ResolvePath(const fs::path& root) {
  std::error_code error;
  fs::path path = fs::weakly_canonical(fs::absolute(root, error), error);
  if (error || path.empty()) {
    throw IoError(fmt::format("{}: not the name of a folder: {}; choose another one", root.string(),
                              error.message()));
  }
  return path.has_filename() ? path : path.parent_path();
}

bool AreOnSameDevice(const fs::path& a, const fs::path& b) {
  struct stat of_a {
  }, of_b{};
  return ::stat(a.c_str(), &of_a) == 0 && ::stat(b.c_str(), &of_b) == 0 &&
         of_a.st_dev == of_b.st_dev;
}

bool Exists(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

// True if the folder is empty, apart from what a killed process has left.
bool IsUnused(const fs::path& folder) {
  std::error_code error;
  SweepTemporaryFiles(folder);
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (at->path().filename() != kPart) {
      return false;
    }
  }
  return !error;
}

// True if the parent folder of `root` can hold the staging folder, and `root` can be replaced by
// it.
bool CanStageBeside(const fs::path& root) {
  const fs::path above = root.parent_path();
  if (above == root) {
    return false;
  }
  std::error_code ignored;
  const bool is_current = fs::equivalent(root, fs::current_path(ignored), ignored);
  return !Exists(root) ||
         (IsUnused(root) && !Exists(root / kPart) && !is_current &&
          ::access(above.c_str(), W_OK | X_OK) == 0 && AreOnSameDevice(root, above));
}

// Throws like OutputFolder.
void RequireUsable(const fs::path& root, WhenNotEmpty when_not_empty) {
  const OutputFolder checked(root, when_not_empty);
}

// Makes the parent folders of `folder`; returns those that were missing. Errors name `shown_path`.
std::vector<fs::path> MakeParents(const fs::path& folder, const fs::path& shown_path) {
  std::vector<fs::path> missing;
  for (fs::path above = folder.parent_path(); !Exists(above) && above != above.parent_path();
       above = above.parent_path()) {
    missing.insert(missing.begin(), above);
  }
  std::error_code error;
  fs::create_directories(folder.parent_path(), error);
  if (error) {
    throw IoError(fmt::format("{}: the folder cannot be created: {}; choose another one",
                              shown_path.string(), error.message()));
  }
  return missing;
}

// The regular files below `folder`, relative to it. The files that `last` names come at the end, in
// the order of `last`.
std::vector<fs::path> FilesBelow(const fs::path& folder, const std::vector<std::string>& last) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files.push_back(entry.path().lexically_relative(folder));
    }
  }
  const auto rank = [&](const fs::path& file) {
    const auto at = std::find(last.rbegin(), last.rend(), file.generic_string());
    return last.rend() - at;  // 0 for a file that is not named
  };
  std::sort(files.begin(), files.end());
  std::stable_sort(files.begin(), files.end(),
                   [&](const fs::path& a, const fs::path& b) { return rank(a) < rank(b); });
  return files;
}

// An unused path of the form ROOT.kept-N.
fs::path FindFreeName(const fs::path& root) {
  for (int n = 1;; ++n) {
    fs::path name = root;
    name += fmt::format(".kept-{}", n);
    if (!Exists(name)) {
      return name;
    }
  }
}

}  // namespace

void FolderClaim::Take(const fs::path& folder, const std::string& what) {
  folder_ = folder;
  for (bool taken = false; !taken;) {
    const bool is_new = ::mkdir(folder.c_str(), 0777) == 0;
    if (!is_new && errno != EEXIST) {
      ThrowCannotCreate(what);
    }
    descriptor_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (descriptor_ < 0 && errno != ENOENT) {  // ENOENT: it was renamed in between
      ThrowCannotCreate(what);
    }
    if (!is_new) {
      RefuseFolderOfOthers(descriptor_, folder, what);
    }
    taken = descriptor_ >= 0 && TryToLock(is_new, what);
  }
  ClearFolder(folder);
}

// False if the folder was renamed in between.
bool FolderClaim::TryToLock(bool is_new, const std::string& what) {
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0) {
    if (HasStillName(descriptor_, folder_)) {
      return true;
    }
    Release();
    return false;
  }
  const bool is_held = errno == EWOULDBLOCK;
  if (!is_held && is_new) {
    return true;  // no locks on this file system, but only this process made the folder
  }
  Release();
  throw IoError(fmt::format(
      "{}: another process is writing it{}; wait until it ends, or choose another folder", what,
      is_held ? ""
              : fmt::format(", or a dead one has left {}, which can then be deleted",
                            folder_.string())));
}

void FolderClaim::Release() {
  if (descriptor_ >= 0) {
    ::close(std::exchange(descriptor_, -1));
  }
}

StagedFolder::StagedFolder(const fs::path& root, WhenNotEmpty when_not_empty, GivenFiles given)
    : root_(ResolvePath(root)), when_not_empty_(when_not_empty), given_(std::move(given)) {
  if (Exists(root_)) {
    RequireUsable(root_, IsUnused(root_) ? WhenNotEmpty::kReplaceFiles : when_not_empty);
    RefuseToReplace(root, given_);
  }
  is_beside_root_ = CanStageBeside(root_);
  made_ = MakeParents(root_, root);
  try {
    const fs::path beside =
        root_.parent_path() / fmt::format(".{}{}", root_.filename().string(), kPart);
    claim_.Take(is_beside_root_ ? beside : root_ / kPart, root.string());
    files_.emplace(claim_.Folder(), WhenNotEmpty::kReplaceFiles);
    if (when_not_empty == WhenNotEmpty::kRefuse && Exists(root_) && !IsUnused(root_)) {
      RequireUsable(root_, when_not_empty);  // files that appeared only now are refused too
    }
  } catch (...) {
    Undo();
    throw;
  }
}

StagedFolder::~StagedFolder() {
  if (!published_) {
    Undo();
  }
}

void StagedFolder::Undo() {
  std::error_code ignored;
  if (files_) {
    fs::remove_all(claim_.Folder(), ignored);
  }
  for (auto folder = made_.rbegin(); folder != made_.rend(); ++folder) {
    fs::remove(*folder, ignored);  // fails, as it should, if another program has written there
  }
}

// Publishes all files in one step. Fails if files have appeared in the root.
bool StagedFolder::RenameToRoot() const {
  std::error_code ignored;
  if (const fs::file_status there = fs::status(root_, ignored); fs::exists(there)) {
    fs::permissions(claim_.Folder(), there.permissions(), ignored);
  }
  return std::rename(claim_.Folder().c_str(), root_.c_str()) == 0;
}

void StagedFolder::Publish(Durability durability) {
  const bool is_occupied =
      when_not_empty_ == WhenNotEmpty::kRefuse && Exists(root_) && !IsUnused(root_);
  if (is_occupied) {
    KeepAndFail("another program has written there in the meantime");
  }
  if (!(is_beside_root_ && RenameToRoot())) {
    MoveFiles();
  }
  if (durability == Durability::kSynced) {
    SyncFolder(root_.parent_path());
  }
  published_ = true;
  claim_.Release();
}

void StagedFolder::MoveFiles() {
  const fs::path& from = claim_.Folder();
  const std::vector<fs::path> files = FilesBelow(from, files_->Written());
  std::error_code error;
  for (const fs::path& file : files) {
    if (fs::is_directory(root_ / file, error)) {
      KeepAndFail(fmt::format("{} is a folder there", file.string()));
    }
    if (IsAnyOf(given_.files, root_ / file)) {
      KeepAndFail(fmt::format("{} is a file that was read", file.string()));
    }
  }
  MakeFoldersFor(files);
  const std::vector<std::string> old = OldFiles(root_, given_, files);
  if (!files.empty()) {
    // The last file, e.g. the manifest, marks a complete folder, so an old one must not stay while
    // the files move.
    fs::remove(root_ / files.back(), error);
  }
  for (const fs::path& file : files) {
    fs::rename(from / file, root_ / file, error);
    if (error) {
      KeepAndFail(fmt::format("{}: {}", file.string(), error.message()));
    }
  }
  RemoveFiles(root_, old);
  fs::remove_all(from, error);
}

void StagedFolder::MakeFoldersFor(const std::vector<fs::path>& files) {
  try {
    for (const fs::path& file : files) {
      MakeFolderBelow(root_, file.parent_path());
    }
  } catch (const IoError& error) {
    KeepAndFail(error.what());
  }
}

void StagedFolder::KeepAndFail(const std::string& why) {
  const fs::path kept = FindFreeName(root_);
  const bool renamed = std::rename(claim_.Folder().c_str(), kept.c_str()) == 0;
  published_ = true;  // so that the destructor keeps the files
  throw IoError(fmt::format("{}: the files cannot be moved there: {}; the missing ones are in {}",
                            root_.string(), why, (renamed ? kept : claim_.Folder()).string()));
}

}  // namespace semblance::problems
