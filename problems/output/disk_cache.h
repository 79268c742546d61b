// SPDX-License-Identifier: GPL-3.0-or-later
// Work that several processes share is done once: bytes in a folder, by the hash of what they were
// made from.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace semblance {

// Safe from several threads and processes: a file is written whole or not at all, carries a hash of
// its content, and is read as missing where it does not fit. Once there is a folder, nothing here
// is an error that stops work: what cannot be kept is made again.
class DiskCache {
 public:
  // Above limit_bytes the files that were read or written longest ago go. Throws IoError if there
  // is no such folder and it cannot be made; one that can only be read is one to read from.
  DiskCache(std::filesystem::path folder, std::uintmax_t limit_bytes);

  // key: lower-case hexadecimal, 64 digits (Sha256OfText).
  std::optional<std::string> Get(const std::string& key) const;
  void Put(const std::string& key, std::string_view bytes) const;

 private:
  std::filesystem::path FileOf(const std::string& key) const;
  void Trim() const;

  std::filesystem::path folder_;
  std::uintmax_t limit_bytes_;
};

}  // namespace semblance
