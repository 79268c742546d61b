// SPDX-License-Identifier: GPL-3.0-or-later
// Hashes of files that many trials of a study share, or that are compared again and again, so that
// each file is read once.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>

namespace semblance::problems {

// Several threads may use one object at the same time.
class FileHashes {
 public:
  // Sha256OfFile. Reads a file again only if its size, its number in the file system, or the time
  // of a change differs. No program can set the time of the last change of state (ctime), so a file
  // that was replaced by one of the same size and date is noticed too.
  std::string Of(const std::filesystem::path& file);

  int read() const;  // the number of files read so far

 private:
  // Device, number, size, and both times in seconds and nanoseconds. All 0 if there is no file.
  using State = std::array<std::uint64_t, 7>;
  struct Known {
    State state;
    std::string hash;
  };
  static State StateOf(const std::filesystem::path& file);
  static bool IsSettled(const State& state);

  mutable std::mutex mutex_;
  std::map<std::string, Known> known_;  // by path
  int read_ = 0;
};

}  // namespace semblance::problems
