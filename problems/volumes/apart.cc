// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/volumes/apart.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <new>
#include <string_view>

#include "surfaces/base/error.h"

#ifdef SEMBLANCE_COVERAGE
extern "C" void __gcov_dump();
#endif

namespace semblance {
namespace {

// What comes through the pipe: a kind, a length, so many bytes.
enum class Kind : char {
  kFile = 'f',
  kResult = 'r',
  kInputError = 'i',
  kIoError = 'o',
  kNoMemory = 'm',
  kOther = 'x'
};

struct Pipe {
  int out = -1, in = -1;
};

Pipe OpenPipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw IoError(fmt::format("no pipe to another process: {}", std::strerror(errno)));
  }
  return {ends[0], ends[1]};
}

void WriteAll(int pipe, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(pipe, bytes.data(), bytes.size());
    if (written < 0 && errno != EINTR) {
      ::_exit(1);  // nobody listens
    }
    bytes.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
  }
}

void Send(int pipe, Kind kind, std::string_view bytes) {
  std::array<char, 9> head{static_cast<char>(kind)};
  const std::uint64_t size = bytes.size();
  std::memcpy(head.data() + 1, &size, sizeof size);
  WriteAll(pipe, {head.data(), head.size()});
  WriteAll(pipe, bytes);
}

// ---------------------------------------------------------------------------------------------
// The other process
// ---------------------------------------------------------------------------------------------

// A sanitizer's own memory is without bounds.
constexpr bool IsSanitized() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return true;
#elif defined(__has_feature)
  return __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
  return false;
#endif
}

double OwnMemory_bytes() {
  double pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

// It ends with its parent, which alone hears of Ctrl-C.
void Settle(double memory_bytes) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::signal(SIGINT, SIG_IGN);
  ::signal(SIGTERM, SIG_DFL);
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  ::dup2(nowhere, STDOUT_FILENO);
  ::dup2(nowhere, STDERR_FILENO);
  rlimit limit{};
  ::setrlimit(RLIMIT_CORE, &limit);
  ::getrlimit(RLIMIT_AS, &limit);
  const auto most = static_cast<rlim_t>(OwnMemory_bytes() + memory_bytes);
  if (!IsSanitized() && most < limit.rlim_cur) {
    limit.rlim_cur = most;
    ::setrlimit(RLIMIT_AS, &limit);
  }
}

// From now on; a library that goes round for ever is ended by the system.
void AllowProcessor(double seconds) {
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  rlimit limit{};
  ::getrlimit(RLIMIT_CPU, &limit);
  const auto most = static_cast<rlim_t>(static_cast<double>(used.ru_utime.tv_sec) +
                                        static_cast<double>(used.ru_stime.tv_sec) + 1 + seconds);
  limit.rlim_cur = std::min(limit.rlim_max, most);
  ::setrlimit(RLIMIT_CPU, &limit);
}

// For each file: what reading so much takes ten times over.
double ProcessorFor_s(double memory_bytes) {
  constexpr double kLeast_s = 1, kBytesPerSecond = 100e6;
  return kLeast_s + memory_bytes / kBytesPerSecond;
}

[[noreturn]] void WorkAndEnd(const std::function<std::string(const TellFile&)>& work,
                             double memory_bytes, int pipe) {
  const auto tell = [&](const std::string& file) {
    AllowProcessor(ProcessorFor_s(memory_bytes));
    Send(pipe, Kind::kFile, file);
  };
  try {
    Send(pipe, Kind::kResult, work(tell));
  } catch (const InputError& error) {
    Send(pipe, Kind::kInputError, error.what());
  } catch (const Error& error) {
    Send(pipe, Kind::kIoError, error.what());
  } catch (const std::bad_alloc&) {
    Send(pipe, Kind::kNoMemory, "");
  } catch (const std::exception& error) {
    Send(pipe, Kind::kOther, error.what());
  }
#ifdef SEMBLANCE_COVERAGE
  __gcov_dump();
#endif
  ::_exit(0);
}

// ---------------------------------------------------------------------------------------------
// This process
// ---------------------------------------------------------------------------------------------

void End(pid_t child) {
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
}

// All that the child sends, until it ends.
std::string Listen(int pipe, pid_t child, const std::stop_token& stop) {
  constexpr int kNap_ms = 50;
  std::string bytes;
  std::array<char, 1 << 16> block{};
  while (!stop.stop_requested()) {
    pollfd waiting{.fd = pipe, .events = POLLIN, .revents = 0};
    if (::poll(&waiting, 1, kNap_ms) <= 0) {
      continue;
    }
    const ssize_t got = ::read(pipe, block.data(), block.size());
    if (got == 0) {
      return bytes;
    }
    bytes.append(block.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  }
  End(child);
  throw Cancelled();
}

struct Told {
  std::string file = "the file";  // the last at hand
  Kind kind = Kind::kFile;        // of the last that came whole
  std::string_view bytes;
};

Told Understand(std::string_view bytes) {
  Told told;
  while (bytes.size() >= 9) {
    std::uint64_t size = 0;
    std::memcpy(&size, bytes.data() + 1, sizeof size);
    if (size > bytes.size() - 9) {
      break;
    }
    told.kind = static_cast<Kind>(bytes[0]);
    told.bytes = bytes.substr(9, size);
    bytes.remove_prefix(9 + size);
    if (told.kind == Kind::kFile) {
      told.file = told.bytes;
    }
  }
  return told;
}

std::string ResultOf(const Told& told) {
  constexpr const char* kRemedy = "the file is damaged; copy or export it again";
  switch (told.kind) {
    case Kind::kResult:
      return std::string(told.bytes);
    case Kind::kInputError:
      throw InputError(std::string(told.bytes));
    case Kind::kIoError:
      throw IoError(std::string(told.bytes));
    case Kind::kNoMemory:
      throw IoError(fmt::format("{}: reading it asks for more memory than such a file can need: {}",
                                told.file, kRemedy));
    case Kind::kOther:
      throw IoError(fmt::format("{}: it cannot be read ({}): {}", told.file, told.bytes, kRemedy));
    default:
      throw IoError(
          fmt::format("{}: the library that reads it gave up on it: {}", told.file, kRemedy));
  }
}

}  // namespace

std::string DoApart(const std::function<std::string(const TellFile&)>& work, double memory_bytes,
                    const std::stop_token& stop) {
  const Pipe pipe = OpenPipe();
  const pid_t child = ::fork();
  if (child == 0) {
    Settle(memory_bytes);
    WorkAndEnd(work, memory_bytes, pipe.in);
  }
  ::close(pipe.in);
  const int out = pipe.out;
  struct Closer {
    int pipe;
    ~Closer() { ::close(pipe); }
  } const closer{out};
  if (child < 0) {
    throw IoError(fmt::format("no process to read it in: {}", std::strerror(errno)));
  }
  const std::string bytes = Listen(out, child, stop);
  ::waitpid(child, nullptr, 0);
  return ResultOf(Understand(bytes));
}

}  // namespace semblance
