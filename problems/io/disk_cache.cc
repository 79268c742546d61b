// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/disk_cache.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <tuple>
#include <utility>
#include <vector>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// A file of the cache is KEY.bin and begins with this line. Other files in the folder are never
// deleted.
constexpr std::string_view kCacheMark = "semblance cache 1\n";
constexpr std::size_t kHashDigits = 64;
constexpr std::string_view kEnding = ".bin";

bool HasCacheName(const fs::path& path) {
  const std::string stem = path.stem().string();
  return path.extension() == kEnding && stem.size() == kHashDigits &&
         stem.find_first_not_of("0123456789abcdef") == stem.npos;
}

bool BeginsWithMark(const fs::path& path) {
  std::string begin(kCacheMark.size(), '\0');
  std::ifstream(path, std::ios::binary)
      .read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return begin == kCacheMark;
}

}  // namespace

DiskCache::DiskCache(fs::path folder, std::uintmax_t limit_bytes)
    : folder_(std::move(folder)), limit_bytes_(limit_bytes) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error || !fs::is_directory(folder_, error)) {
    throw IoError(fmt::format("{}: no folder for the cache, and it cannot be created{}{}",
                              folder_.string(), error ? ": " : "",
                              error ? error.message() : std::string()));
  }
}

fs::path DiskCache::FilePath(const std::string& key) const {
  return folder_ / (key + std::string(kEnding));
}

std::optional<std::string> DiskCache::Get(const std::string& key) const {
  std::string file;
  try {
    file = ReadFileBytes(FilePath(key));
  } catch (const IoError&) {
    return std::nullopt;
  }
  constexpr std::size_t kHead = kCacheMark.size() + kHashDigits;
  std::string bytes = file.substr(std::min(file.size(), kHead));
  if (file.substr(0, kHead) != std::string(kCacheMark) + Sha256OfText(bytes)) {
    return std::nullopt;
  }
  std::error_code ignored;
  fs::last_write_time(FilePath(key), fs::file_time_type::clock::now(), ignored);
  return bytes;
}

void DiskCache::Put(const std::string& key, std::string_view bytes) const {
  try {
    SweepTemporaryFiles(folder_);
    WriteFileAtomically(FilePath(key),
                        std::string(kCacheMark).append(Sha256OfText(bytes)).append(bytes));
  } catch (const IoError&) {
    return;  // on a full disk the value is computed again
  }
  Trim();
}

void DiskCache::Trim() const {
  struct KeptFile {
    fs::file_time_type used;
    fs::path path;
    std::uintmax_t size;
  };
  std::vector<KeptFile> files;
  std::uintmax_t total = 0;
  std::error_code error;  // files may vanish at any time, because other processes trim too
  for (fs::directory_iterator at(folder_, error), end; !error && at != end; at.increment(error)) {
    std::error_code gone;
    const std::uintmax_t size = at->file_size(gone);
    const fs::file_time_type used = gone ? fs::file_time_type() : at->last_write_time(gone);
    if (!gone && HasCacheName(at->path()) && BeginsWithMark(at->path())) {
      files.push_back({used, at->path(), size});
      total += size;
    }
  }
  std::sort(files.begin(), files.end(), [](const KeptFile& a, const KeptFile& b) {
    return std::tie(a.used, a.path) < std::tie(b.used, b.path);
  });
  for (const KeptFile& file : files) {
    if (total <= limit_bytes_) {
      return;
    }
    fs::remove(file.path, error);
    total -= file.size;
  }
}

}  // namespace semblance::problems
