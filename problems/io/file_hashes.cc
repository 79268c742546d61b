// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/file_hashes.h"

#include <sys/stat.h>

#include <ctime>

#include "surfaces/base/encoding.h"

namespace semblance::problems {

namespace fs = std::filesystem;

FileHashes::State FileHashes::StateOf(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) {
    return {};  // Sha256OfFile reports a file that cannot be read
  }
  const auto number = [](auto value) { return static_cast<std::uint64_t>(value); };
  return {number(status.st_dev),          number(status.st_ino),
          number(status.st_size),         number(status.st_mtim.tv_sec),
          number(status.st_mtim.tv_nsec), number(status.st_ctim.tv_sec),
          number(status.st_ctim.tv_nsec)};
}

// The clock of a file system may be coarse: a file that has just changed may change again at the
// same time. Its hash is not kept.
bool FileHashes::IsSettled(const State& state) {
  constexpr std::uint64_t kCoarsest_s = 2;
  return static_cast<std::uint64_t>(std::time(nullptr)) > state[5] + kCoarsest_s;
}

std::string FileHashes::Of(const fs::path& file) {
  const State state = StateOf(file);
  {
    const std::lock_guard lock(mutex_);
    const auto known = known_.find(file.string());
    if (known != known_.end() && known->second.state == state) {
      return known->second.hash;
    }
  }
  std::string hash = Sha256OfFile(file);
  const std::lock_guard lock(mutex_);
  ++read_;
  if (IsSettled(state)) {
    known_[file.string()] = {state, hash};
  }
  return hash;
}

int FileHashes::read() const {
  const std::lock_guard lock(mutex_);
  return read_;
}

}  // namespace semblance::problems
