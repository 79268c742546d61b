// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/disk_cache.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

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

// A file of the cache is KEY.bin and begins with this line. Files of former versions begin with
// another number, and are only deleted. Other files in the folder are never deleted.
constexpr std::string_view kCacheMark = "semblance cache 2\n";
constexpr std::string_view kAnyMark = "semblance cache ";
constexpr std::size_t kHashDigits = 64;
constexpr std::string_view kEnding = ".bin";

bool HasCacheName(const fs::path& path) {
  const std::string stem = path.stem().string();
  return path.extension() == kEnding && stem.size() == kHashDigits &&
         stem.find_first_not_of("0123456789abcdef") == stem.npos;
}

bool BeginsWithMark(const fs::path& path) {
  std::string begin(kAnyMark.size(), '\0');
  std::ifstream(path, std::ios::binary)
      .read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return begin == kAnyMark;
}

std::string HashOf(const std::string& key, std::string_view bytes) {
  Sha256 hash;
  hash.Add(key);
  hash.Add(bytes);
  return hash.Hex();
}

// An open file, so that the file whose owner is checked is the one that is read.
class OpenFile {
 public:
  // Does not follow a link, and does not wait for a pipe.
  explicit OpenFile(const fs::path& path)
      : descriptor_(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC)) {}
  ~OpenFile() {
    if (descriptor_ >= 0) {
      ::close(descriptor_);
    }
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  // Returns true for a regular file of this user, of `folder_owner` or of root.
  bool IsTrusted(uid_t folder_owner) const {
    struct stat status {};
    return descriptor_ >= 0 && ::fstat(descriptor_, &status) == 0 && S_ISREG(status.st_mode) &&
           (status.st_uid == ::geteuid() || status.st_uid == folder_owner || status.st_uid == 0);
  }

  // Empty if a part cannot be read.
  std::string Read() const {
    struct stat status {};
    std::string bytes;
    bytes.resize(::fstat(descriptor_, &status) == 0 ? static_cast<std::size_t>(status.st_size) : 0);
    std::size_t done = 0;
    while (done < bytes.size()) {
      const ssize_t got = ::read(descriptor_, bytes.data() + done, bytes.size() - done);
      if (got <= 0) {
        return {};
      }
      done += static_cast<std::size_t>(got);
    }
    return bytes;
  }

  void SetTimeToNow() const { ::futimens(descriptor_, nullptr); }

 private:
  int descriptor_;
};

uid_t OwnerOf(const fs::path& folder) {
  struct stat status {};
  return ::stat(folder.c_str(), &status) == 0 ? status.st_uid : ::geteuid();
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
  const OpenFile file(FilePath(key));
  if (!file.IsTrusted(OwnerOf(folder_))) {
    return std::nullopt;
  }
  constexpr std::size_t kHead = kCacheMark.size() + kHashDigits;
  const std::string all = file.Read();
  std::string bytes = all.substr(std::min(all.size(), kHead));
  if (all.substr(0, kHead) != std::string(kCacheMark) + HashOf(key, bytes)) {
    return std::nullopt;
  }
  file.SetTimeToNow();
  return bytes;
}

void DiskCache::Put(const std::string& key, std::string_view bytes) const {
  try {
    SweepTemporaryFiles(folder_);
    WriteFileAtomically(FilePath(key),
                        std::string(kCacheMark).append(HashOf(key, bytes)).append(bytes));
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
