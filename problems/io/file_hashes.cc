// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/file_hashes.h"
#include "surfaces/base/encoding.h"

#include <system_error>

namespace semblance::problems {

namespace fs = std::filesystem;

std::string FileHashes::Of(const fs::path& file) {
  std::error_code ignored;  // Sha256OfFile reports a file that cannot be read
  const std::uintmax_t size = fs::file_size(file, ignored);
  const fs::file_time_type changed = fs::last_write_time(file, ignored);
  {
    const std::lock_guard lock(mutex_);
    const auto known = known_.find(file.string());
    if (known != known_.end() && known->second.size == size && known->second.changed == changed) {
      return known->second.hash;
    }
  }
  std::string hash = Sha256OfFile(file);
  const std::lock_guard lock(mutex_);
  known_[file.string()] = {size, changed, hash};
  return hash;
}

}  // namespace semblance::problems
