// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/temporary_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <atomic>
#include <cctype>
#include <string_view>
#include <system_error>

namespace semblance {
namespace {

namespace fs = std::filesystem;

// Whether a name ends in digits, which are cut off.
bool TakeDigits(std::string_view& name) {
  const std::size_t before = name.size();
  while (!name.empty() && std::isdigit(static_cast<unsigned char>(name.back())) != 0) {
    name.remove_suffix(1);
  }
  return name.size() < before;
}

// A name that TemporaryBeside gives: ".face.ply.123-4.tmp".
bool IsTemporaryName(std::string_view name) {
  constexpr std::string_view kEnding = ".tmp";
  if (!name.starts_with('.') || !name.ends_with(kEnding)) {
    return false;
  }
  name.remove_suffix(kEnding.size());
  if (!TakeDigits(name) || !name.ends_with('-')) {
    return false;
  }
  name.remove_suffix(1);
  return TakeDigits(name) && name.ends_with('.') && name.size() > 2;
}

// Removes a file that nobody has locked.
void RemoveIfLeft(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor >= 0) {
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) {
      ::unlink(path.c_str());
    }
    ::close(descriptor);
  }
}

}  // namespace

fs::path TemporaryBeside(const fs::path& path) {
  static std::atomic<int> count{0};
  return path.parent_path() /
         fmt::format(".{}.{}-{}.tmp", path.filename().string(), ::getpid(), count++);
}

void SweepTemporaryFiles(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (IsTemporaryName(at->path().filename().string())) {
      RemoveIfLeft(at->path());
    }
  }
}

void SyncFolder(const fs::path& folder) {
  const int descriptor =
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor >= 0) {
    ::fsync(descriptor);
    ::close(descriptor);
  }
}

}  // namespace semblance
