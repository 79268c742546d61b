// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/output/disk_cache.h"

#include <algorithm>
#include <tuple>
#include <vector>

#include "problems/output/manifest.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHashDigits = 64;

}  // namespace

fs::path DiskCache::FileOf(const std::string& key) const { return folder_ / (key + ".bin"); }

std::optional<std::string> DiskCache::Get(const std::string& key) const {
  std::string file;
  try {
    file = ReadFileBytes(FileOf(key));
  } catch (const IoError&) {
    return std::nullopt;
  }
  std::string bytes = file.substr(std::min(file.size(), kHashDigits));
  if (file.compare(0, kHashDigits, Sha256OfText(bytes)) != 0) {
    return std::nullopt;
  }
  std::error_code ignored;
  fs::last_write_time(FileOf(key), fs::file_time_type::clock::now(), ignored);
  return bytes;
}

void DiskCache::Put(const std::string& key, std::string_view bytes) const {
  std::error_code ignored;
  fs::create_directories(folder_, ignored);
  try {
    WriteFileAtomically(FileOf(key), Sha256OfText(bytes).append(bytes));
  } catch (const IoError&) {
    return;  // a full disk costs time, not the result
  }
  Trim();
}

void DiskCache::Trim() const {
  struct Kept {
    fs::file_time_type used;
    fs::path path;
    std::uintmax_t size;
  };
  std::vector<Kept> files;
  std::uintmax_t total = 0;
  std::error_code error;  // another process may be trimming too: files may vanish at any time
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    const std::uintmax_t size = entry.file_size(error);
    const fs::file_time_type used = error ? fs::file_time_type() : entry.last_write_time(error);
    if (!error && entry.path().extension() == ".bin") {
      files.push_back({used, entry.path(), size});
      total += size;
    }
  }
  std::sort(files.begin(), files.end(), [](const Kept& a, const Kept& b) {
    return std::tie(a.used, a.path) < std::tie(b.used, b.path);
  });
  for (const Kept& file : files) {
    if (total <= limit_bytes_) {
      return;
    }
    fs::remove(file.path, error);
    total -= file.size;
  }
}

}  // namespace semblance
