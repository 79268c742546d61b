// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/child_process.h"

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

#include "problems/io/volumes/confinement.h"
#include "surfaces/base/error.h"

#ifdef SEMBLANCE_COVERAGE
extern "C" void __gcov_dump();
#endif

namespace semblance::problems {
namespace {

// A message in the pipe: its kind (1 byte), its length (8 bytes), and its content.
enum class MessageKind : char {
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
    throw IoError(
        fmt::format("a pipe to a child process cannot be made: {}", std::strerror(errno)));
  }
  return {ends[0], ends[1]};
}

void WriteAll(int pipe, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(pipe, bytes.data(), bytes.size());
    if (written < 0 && errno != EINTR) {
      ::_exit(1);  // the parent does not read any more
    }
    bytes.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
  }
}

void Send(int pipe, MessageKind kind, std::string_view bytes) {
  std::array<char, 9> head{static_cast<char>(kind)};
  const std::uint64_t size = bytes.size();
  std::memcpy(head.data() + 1, &size, sizeof size);
  WriteAll(pipe, {head.data(), head.size()});
  WriteAll(pipe, bytes);
}

// ---------------------------------------------------------------------------------------------
// The child process
// ---------------------------------------------------------------------------------------------

// A sanitizer reserves so much memory that no limit makes sense.
constexpr bool IsSanitized() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return true;
#elif defined(__has_feature)
  return __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
  return false;
#endif
}

double UsedMemory_bytes() {
  double pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

// Closes the terminal, and all other files of the parent: among them may be connections of the
// workbench. Returns the pipe's new descriptor.
int CloseFiles(int parent_pipe) {
  const int pipe = ::fcntl(parent_pipe, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  const int null_device = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    ::dup2(null_device, descriptor);
  }
  ::close_range(STDERR_FILENO + 1, static_cast<unsigned>(pipe) - 1, 0);
  ::close_range(static_cast<unsigned>(pipe) + 1, ~0U, 0);
  return pipe;
}

// Ends the child with its parent, ignores Ctrl-C (which the parent handles), limits the memory, and
// takes all rights that reading does not need. Returns the pipe's new descriptor.
int PrepareChild(const ChildRights& rights, int parent_pipe) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::signal(SIGINT, SIG_IGN);
  ::signal(SIGTERM, SIG_DFL);
  const int pipe = CloseFiles(parent_pipe);
  rlimit limit{};
  ::setrlimit(RLIMIT_CORE, &limit);
  ::getrlimit(RLIMIT_AS, &limit);
  const auto allowed_bytes = static_cast<rlim_t>(UsedMemory_bytes() + rights.memory_bytes);
  if (!IsSanitized() && allowed_bytes < limit.rlim_cur) {
    limit.rlim_cur = allowed_bytes;
    ::setrlimit(RLIMIT_AS, &limit);
  }
#ifndef SEMBLANCE_COVERAGE  // whose counters are written to files
  if (!IsSanitized()) {
    Confine(rights.readable);
  }
#endif
  return pipe;
}

// Limits the processor time from now on, so that the system ends a library in an endless loop.
void LimitProcessorTime(double seconds) {
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  rlimit limit{};
  ::getrlimit(RLIMIT_CPU, &limit);
  const auto allowed_s =
      static_cast<rlim_t>(static_cast<double>(used.ru_utime.tv_sec) +
                          static_cast<double>(used.ru_stime.tv_sec) + 1 + seconds);
  limit.rlim_cur = std::min(limit.rlim_max, allowed_s);
  ::setrlimit(RLIMIT_CPU, &limit);
}

// The limit for each file: about ten times the time that reading this amount of memory takes.
double ProcessorLimit_s(double memory_bytes) {
  constexpr double kStart_s = 1, kBytesPerSecond = 100e6;
  return kStart_s + memory_bytes / kBytesPerSecond;
}

[[noreturn]] void RunAndExit(const std::function<std::string(const ReportFile&)>& work,
                             double memory_bytes, int pipe) {
  const auto report = [&](const std::string& file) {
    LimitProcessorTime(ProcessorLimit_s(memory_bytes));
    Send(pipe, MessageKind::kFile, file);
  };
  try {
    Send(pipe, MessageKind::kResult, work(report));
  } catch (const InputError& error) {
    Send(pipe, MessageKind::kInputError, error.what());
  } catch (const Error& error) {
    Send(pipe, MessageKind::kIoError, error.what());
  } catch (const std::bad_alloc&) {
    Send(pipe, MessageKind::kNoMemory, "");
  } catch (const std::exception& error) {
    Send(pipe, MessageKind::kOther, error.what());
  }
#ifdef SEMBLANCE_COVERAGE
  __gcov_dump();
#endif
  ::_exit(0);
}

// ---------------------------------------------------------------------------------------------
// The parent process
// ---------------------------------------------------------------------------------------------

void KillChild(pid_t child) {
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
}

// Returns all bytes that the child sends until it ends.
std::string ReadUntilEnd(int pipe, pid_t child, const std::stop_token& stop) {
  // A shorter interval answers a stop sooner and wakes the processor more often.
  constexpr int kPollInterval_ms = 50;
  std::string bytes;
  std::array<char, 1 << 16> block{};
  while (!stop.stop_requested()) {
    pollfd waiting{.fd = pipe, .events = POLLIN, .revents = 0};
    if (::poll(&waiting, 1, kPollInterval_ms) <= 0) {
      continue;
    }
    const ssize_t got = ::read(pipe, block.data(), block.size());
    if (got == 0) {
      return bytes;
    }
    bytes.append(block.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  }
  KillChild(child);
  throw Cancelled();
}

// The last complete message, and the last file that was reported.
struct ChildMessages {
  std::string file = "the file";
  MessageKind kind = MessageKind::kFile;
  std::string_view bytes;
};

ChildMessages ParseMessages(std::string_view bytes) {
  ChildMessages last;
  while (bytes.size() >= 9) {
    std::uint64_t size = 0;
    std::memcpy(&size, bytes.data() + 1, sizeof size);
    if (size > bytes.size() - 9) {
      break;
    }
    last.kind = static_cast<MessageKind>(bytes[0]);
    last.bytes = bytes.substr(9, size);
    bytes.remove_prefix(9 + size);
    if (last.kind == MessageKind::kFile) {
      last.file = last.bytes;
    }
  }
  return last;
}

std::string ResultOrThrow(const ChildMessages& last) {
  constexpr const char* kRemedy = "the file is damaged; copy or export it again";
  switch (last.kind) {
    case MessageKind::kResult:
      return std::string(last.bytes);
    case MessageKind::kInputError:
      throw InputError(std::string(last.bytes));
    case MessageKind::kIoError:
      throw IoError(std::string(last.bytes));
    case MessageKind::kNoMemory:
      throw IoError(
          fmt::format("{}: reading it requires more memory than a file of this size can need: {}",
                      last.file, kRemedy));
    case MessageKind::kOther:
      throw IoError(fmt::format("{}: it cannot be read ({}): {}", last.file, last.bytes, kRemedy));
    default:
      throw IoError(fmt::format("{}: the library that reads it failed or took too long: {}",
                                last.file, kRemedy));
  }
}

}  // namespace

std::string RunInChildProcess(const std::function<std::string(const ReportFile&)>& work,
                              const ChildRights& rights, const std::stop_token& stop) {
  const Pipe pipe = OpenPipe();
  const pid_t child = ::fork();
  if (child == 0) {
    RunAndExit(work, rights.memory_bytes, PrepareChild(rights, pipe.in));
  }
  ::close(pipe.in);
  const int out = pipe.out;
  struct Closer {
    int pipe;
    ~Closer() { ::close(pipe); }
  } const closer{out};
  if (child < 0) {
    throw IoError(fmt::format("a child process to read the file cannot be started: {}",
                              std::strerror(errno)));
  }
  const std::string bytes = ReadUntilEnd(out, child, stop);
  ::waitpid(child, nullptr, 0);
  return ResultOrThrow(ParseMessages(bytes));
}

}  // namespace semblance::problems
