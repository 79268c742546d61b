// SPDX-License-Identifier: GPL-3.0-or-later
// A cache on disk that several processes share: results are bytes in a folder, and the key is the
// hash of what they were computed from.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace semblance::problems {

// Several threads and processes may use one folder at the same time: a file is written whole or not
// at all, contains a hash of its key and its content, and counts as missing if the hash does not
// match. Faults of the disk are not errors: a value that cannot be stored is computed again.
//
// In a folder that several people write to, a file counts as missing unless it belongs to this
// user, to the folder's owner or to root. A hash protects from damage and from exchanged files, but
// anybody can compute one; so another person could otherwise provide any value.
class DiskCache {
 public:
  // If the files exceed limit_bytes, those that were read or written longest ago are deleted.
  // Throws IoError if there is no such folder and it cannot be made. A folder without permission to
  // write serves for reading.
  DiskCache(std::filesystem::path folder, std::uintmax_t limit_bytes);

  // key: 64 lower-case hexadecimal digits (Sha256OfText).
  std::optional<std::string> Get(const std::string& key) const;
  void Put(const std::string& key, std::string_view bytes) const;

 private:
  std::filesystem::path FilePath(const std::string& key) const;
  void Trim() const;

  std::filesystem::path folder_;
  std::uintmax_t limit_bytes_;
};

}  // namespace semblance::problems
