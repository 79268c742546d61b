// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <list>
#include <new>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "surfaces/base/error.h"

namespace semblance::surfaces {
namespace {

namespace fs = std::filesystem;

std::string Reason(int error_number) { return std::generic_category().message(error_number); }

constexpr std::string_view kTemporaryStart = ".semblance-", kTemporaryEnding = ".tmp";
constexpr std::size_t kRandomDigits = 16;

// The name is random, so that nobody can prepare a link of this name in a shared folder.
fs::path RandomTemporaryName(const fs::path& folder) {
  std::uint64_t random = 0;
  if (::getrandom(&random, sizeof random, 0) != static_cast<ssize_t>(sizeof random)) {
    throw IoError(fmt::format("{}: the system gives no random numbers, which temporary files need",
                              folder.string()));
  }
  return folder / fmt::format("{}{:016x}{}", kTemporaryStart, random, kTemporaryEnding);
}

// Creates a file that nobody has created or linked before. Returns its descriptor, or -1 with the
// reason in errno.
int CreateTemporary(const fs::path& folder, fs::path& name) {
  int descriptor = -1;
  do {
    name = RandomTemporaryName(folder);
    descriptor = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  } while (descriptor < 0 && errno == EEXIST);
  return descriptor;
}

// Owns a temporary file: closes its descriptor and removes the file unless it was renamed. The file
// stays locked while it is written, so that a sweep leaves it alone.
class TemporaryFile {
 public:
  explicit TemporaryFile(const fs::path& target) : target_(target) {
    do {
      Close();
      descriptor_ = CreateTemporary(target.parent_path(), temporary_);
      if (descriptor_ < 0) {
        Fail();
      }
      ::flock(descriptor_, LOCK_EX);  // without locks on this system, a sweep gets no lock either
    } while (WasSwept());
  }
  ~TemporaryFile() {
    Close();
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

  void Sync() const {
    if (::fsync(descriptor_) != 0) {
      Fail();
    }
  }

  // The last step: afterwards the target holds the new bytes.
  void Rename(Durability durability) {
    if (durability == Durability::kSynced) {
      Sync();
    }
    if (::close(std::exchange(descriptor_, -1)) != 0 ||
        ::rename(temporary_.c_str(), target_.c_str()) != 0) {
      Fail();
    }
    renamed_ = true;
  }

 private:
  // A sweep may have removed the file between its creation and its lock.
  bool WasSwept() const {
    struct stat file {};
    return ::fstat(descriptor_, &file) == 0 && file.st_nlink == 0;
  }

  void Close() {
    if (descriptor_ >= 0) {
      ::close(std::exchange(descriptor_, -1));
    }
  }

  [[noreturn]] void Fail() const {
    const int error_number = errno;
    throw IoError(fmt::format(
        "{}: cannot be written: {}; check that the folder exists and may be written to, and that "
        "the disk has room",
        target_.string(), Reason(error_number)));
  }

  fs::path target_;
  fs::path temporary_;
  int descriptor_ = -1;
  bool renamed_ = false;
};

// Reads the bytes beyond the size that the system states: those of a pipe, or of a file that grew.
void AppendRest(std::ifstream& file, const fs::path& path, std::string& bytes) {
  constexpr std::size_t kBlock = 1 << 20, kMaxBytes = std::size_t{256} << 20;
  const std::size_t before = bytes.size();
  while (file && bytes.size() - before <= kMaxBytes) {
    const std::size_t at = bytes.size();
    bytes.resize(at + kBlock);
    file.read(bytes.data() + at, kBlock);
    bytes.resize(at + static_cast<std::size_t>(file.gcount()));
  }
  if (bytes.size() - before > kMaxBytes) {
    throw IoError(
        fmt::format("{}: more than 256 MB come out of what is not a regular file; save them in one "
                    "and name that",
                    path.string()));
  }
}

// Reads a regular file with few calls of the system, because a study reads hundreds of thousands of
// small ones. Returns nothing for anything else, without opening it: a pipe can be opened only
// once.
std::optional<std::string> ReadRegularFile(const fs::path& path) {
  struct stat state {};
  if (::stat(path.c_str(), &state) != 0 || !S_ISREG(state.st_mode)) {
    return std::nullopt;
  }
  std::string bytes(static_cast<std::size_t>(state.st_size) + 1, '\0');  // one more finds the end
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  std::size_t size = 0;
  ssize_t more = descriptor < 0 ? -1 : 1;
  while (more > 0 && size < bytes.size()) {
    more = ::read(descriptor, bytes.data() + size, bytes.size() - size);
    size += more > 0 ? static_cast<std::size_t>(more) : 0;
  }
  if (descriptor >= 0) {
    ::close(descriptor);
  }
  bytes.resize(size);
  return more == 0 ? std::optional(std::move(bytes)) : std::nullopt;
}

void RefuseFolder(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    throw IoError(fmt::format("{}: is a folder, not a file", path.string()));
  }
}

std::string ReadBytes(const fs::path& path) {
  std::error_code error;
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  const std::uintmax_t size = fs::is_regular_file(path, error) ? fs::file_size(path, error) : 0;
  std::string bytes(error ? 0 : size, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  if (file) {
    AppendRest(file, path, bytes);
  }
  if (!file.is_open() || file.bad()) {
    throw IoError(fmt::format("{}: cannot be read: {}", path.string(), Reason(errno)));
  }
  return bytes;
}

[[noreturn]] void FailTooLarge(const fs::path& path) {
  std::error_code ignored;
  throw IoError(fmt::format("{}: not enough memory for its {} MB", path.string(),
                            fs::file_size(path, ignored) >> 20));
}

// Recognises the names that RandomTemporaryName makes.
bool IsTemporaryName(std::string_view name) {
  if (!name.starts_with(kTemporaryStart) || !name.ends_with(kTemporaryEnding)) {
    return false;
  }
  name.remove_prefix(kTemporaryStart.size());
  name.remove_suffix(kTemporaryEnding.size());
  return name.size() == kRandomDigits &&
         name.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

// Removes the file unless a process has locked it.
void RemoveIfUnlocked(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor >= 0) {
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) {
      ::unlink(path.c_str());
    }
    ::close(descriptor);
  }
}

}  // namespace

void WriteFileAtomically(const fs::path& path, std::string_view bytes, Durability durability) {
  TemporaryFile file(path);
  file.Write(bytes);
  file.Rename(durability);
  if (durability == Durability::kSynced) {
    SyncFolder(path.parent_path());
  }
}

void WriteFilesTogether(std::span<const FileBytes> files) {
  std::list<TemporaryFile> written;
  for (const FileBytes& file : files) {
    RefuseFolder(file.path);
    written.emplace_back(file.path).Write(file.bytes);
    written.back().Sync();
  }
  for (TemporaryFile& file : written) {
    file.Rename(Durability::kUnsynced);  // it was synced above
  }
  for (const FileBytes& file : files) {
    SyncFolder(file.path.parent_path());
  }
}

NewFolders::NewFolders(const fs::path& folder) {
  std::error_code error;
  for (fs::path at = folder; !at.empty() && !fs::exists(at, error) && !error;
       at = at.parent_path()) {
    made_.insert(made_.begin(), at);
  }
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder, error)) {
    Remove();
    throw IoError(fmt::format("{}: the folder cannot be created: {}; choose another one",
                              folder.string(),
                              error ? error.message() : std::string("a file of this name exists")));
  }
}

NewFolders::~NewFolders() { Remove(); }

void NewFolders::Remove() {
  std::error_code ignored;
  for (auto folder = made_.rbegin(); folder != made_.rend(); ++folder) {
    fs::remove(*folder, ignored);  // fails, as it should, for a folder that is not empty
  }
}

std::string ReadFileBytes(const fs::path& path) {
  try {
    if (std::optional<std::string> bytes = ReadRegularFile(path)) {
      return *std::move(bytes);
    }
    std::error_code error;
    if (!fs::exists(path, error) && !error) {
      throw IoError(fmt::format("{}: no such file", path.string()));
    }
    RefuseFolder(path);
    return ReadBytes(path);
  } catch (const std::bad_alloc&) {
    FailTooLarge(path);
  } catch (const std::length_error&) {
    FailTooLarge(path);
  }
}

std::string FindWritingFault(const fs::path& folder) {
  fs::path probe;
  const int descriptor = CreateTemporary(folder, probe);
  if (descriptor < 0) {
    return Reason(errno);
  }
  ::close(descriptor);
  ::unlink(probe.c_str());
  return "";
}

void SweepTemporaryFiles(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (IsTemporaryName(at->path().filename().string())) {
      RemoveIfUnlocked(at->path());
    }
  }
}

void SyncFolder(const fs::path& folder) {
  const int descriptor =
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor >= 0) {
    ::fsync(descriptor);
    ::close(descriptor);
  }
}

}  // namespace semblance::surfaces
