// SPDX-License-Identifier: GPL-3.0-or-later
// Hashes of files that many trials of a study share, so that each file is read once.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>

namespace semblance::problems {

// Several threads may use one object at the same time.
class FileHashes {
 public:
  // Sha256OfFile. Reads a file again only if its size or the time of its last change differs.
  std::string Of(const std::filesystem::path& file);

 private:
  struct Known {
    std::uintmax_t size = 0;
    std::filesystem::file_time_type changed;
    std::string hash;
  };
  std::mutex mutex_;
  std::map<std::string, Known> known_;  // by path
};

}  // namespace semblance::problems
