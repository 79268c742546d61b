// SPDX-License-Identifier: GPL-3.0-or-later
// The hashes of files that many trials of a study have in common.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>

namespace semblance {

// Several threads may ask at a time.
class FileHashes {
 public:
  // Sha256OfFile. A file is read again only once its size or the time of its last change is
  // another.
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

}  // namespace semblance
