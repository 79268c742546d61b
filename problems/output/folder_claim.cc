// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/output/folder_claim.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void FailToMake(const std::string& what) {
  throw IoError(fmt::format("{}: the folder cannot be created: {}; choose another one", what,
                            std::generic_category().message(errno)));
}

// Whether the open folder is still the one of that name: its holder may have renamed it.
bool IsStillThere(int descriptor, const fs::path& folder) {
  struct stat open {
  }, named{};
  return ::fstat(descriptor, &open) == 0 && ::lstat(folder.c_str(), &named) == 0 &&
         open.st_ino == named.st_ino && open.st_dev == named.st_dev;
}

void Clear(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code ignored;
    fs::remove_all(at->path(), ignored);
  }
}

}  // namespace

void FolderClaim::Take(const fs::path& folder, const std::string& what) {
  folder_ = folder;
  for (bool taken = false; !taken;) {
    const bool is_new = ::mkdir(folder.c_str(), 0777) == 0;
    if (!is_new && errno != EEXIST) {
      FailToMake(what);
    }
    descriptor_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (descriptor_ < 0 && errno != ENOENT) {  // that one: renamed in between
      FailToMake(what);
    }
    taken = descriptor_ >= 0 && TryToLock(is_new, what);
  }
  Clear(folder);
}

// False if the folder has got another name in between.
bool FolderClaim::TryToLock(bool is_new, const std::string& what) {
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0) {
    if (IsStillThere(descriptor_, folder_)) {
      return true;
    }
    Release();
    return false;
  }
  const bool is_held = errno == EWOULDBLOCK;
  if (!is_held && is_new) {
    return true;  // no locks here, but nobody else could make it
  }
  Release();
  throw IoError(fmt::format(
      "{}: another process is writing it{}; wait for that one to end, or choose another folder",
      what,
      is_held ? "" : fmt::format(", or has left {}, which can then be deleted", folder_.string())));
}

void FolderClaim::Release() {
  if (descriptor_ >= 0) {
    ::close(std::exchange(descriptor_, -1));
  }
}

}  // namespace semblance
