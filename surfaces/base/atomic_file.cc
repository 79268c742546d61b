// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

std::string Reason(int error_number) { return std::generic_category().message(error_number); }

// A file descriptor that is closed, and a temporary file that is removed, whatever happens.
class TemporaryFile {
 public:
  TemporaryFile(const fs::path& target, fs::path temporary)
      : target_(target), temporary_(std::move(temporary)) {
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (descriptor_ < 0) {
      Fail();
    }
  }
  ~TemporaryFile() {
    if (descriptor_ >= 0) {
      ::close(descriptor_);
    }
    if (!renamed_) {
      ::unlink(temporary_.c_str());
    }
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void Write(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno != EINTR) {
        Fail();
      }
      bytes.remove_prefix(written > 0 ? static_cast<std::size_t>(written) : 0);
    }
  }

  // The last step: from here on the target holds the new bytes.
  void Rename(Durability durability) {
    const bool sync = durability == Durability::kSynced;
    if ((sync && ::fsync(descriptor_) != 0) || ::close(std::exchange(descriptor_, -1)) != 0 ||
        ::rename(temporary_.c_str(), target_.c_str()) != 0) {
      Fail();
    }
    renamed_ = true;
  }

 private:
  [[noreturn]] void Fail() const {
    const int error_number = errno;
    throw IoError(fmt::format(
        "{}: cannot be written: {}; check that the folder exists and may be written to, and that "
        "the disk has room",
        target_.string(), Reason(error_number)));
  }

  const fs::path& target_;
  fs::path temporary_;
  int descriptor_ = -1;
  bool renamed_ = false;
};

fs::path TemporaryBeside(const fs::path& path) {
  static std::atomic<int> count{0};
  return path.parent_path() /
         fmt::format(".{}.{}-{}.tmp", path.filename().string(), ::getpid(), count++);
}

// Makes the rename itself last over a power failure, where the file system can.
void SyncFolder(const fs::path& folder) {
  const int descriptor =
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor >= 0) {
    ::fsync(descriptor);
    ::close(descriptor);
  }
}

}  // namespace

void WriteFileAtomically(const fs::path& path, std::string_view bytes, Durability durability) {
  TemporaryFile file(path, TemporaryBeside(path));
  file.Write(bytes);
  file.Rename(durability);
  if (durability == Durability::kSynced) {
    SyncFolder(path.parent_path());
  }
}

std::string ReadFileBytes(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error) && !error) {
    throw IoError(fmt::format("{}: no such file", path.string()));
  }
  if (fs::is_directory(path, error)) {
    throw IoError(fmt::format("{}: is a folder, not a file", path.string()));
  }
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  const std::uintmax_t size = fs::is_regular_file(path, error) ? fs::file_size(path, error) : 0;
  std::string bytes(error ? 0 : size, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  if (file) {  // whatever has no size: a pipe, a file that grew meanwhile
    bytes.append(std::istreambuf_iterator<char>(file), {});
  }
  if (!file.is_open() || file.bad()) {
    throw IoError(fmt::format("{}: cannot be read: {}", path.string(), Reason(errno)));
  }
  return bytes;
}

}  // namespace semblance
