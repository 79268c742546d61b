// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/child_process.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "problems/io/volumes/confinement.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kMemory_bytes = 256e6;

std::string Do(const std::function<std::string(const ReportFile&)>& work) {
  return RunInChildProcess(work, {.memory_bytes = kMemory_bytes}, {});
}

template <class Thrown>
std::string MessageOfWork(const std::function<void()>& work) {
  try {
    Do([&](const ReportFile& report) {
      report("a.dcm");
      report("b.dcm");
      work();
      return std::string();
    });
  } catch (const Thrown& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(ChildProcess, TheResultOfTheWorkArrivesComplete) {
  const std::string large(3'000'000, 'x');
  EXPECT_EQ(Do([&](const ReportFile&) { return large; }), large);
  EXPECT_EQ(Do([](const ReportFile&) { return std::string(); }), "");
}

TEST(ChildProcess, NothingElseOfTheWorkIsVisible) {
  int here = 1;
  ::testing::internal::CaptureStderr();
  Do([&](const ReportFile&) {
    here = 2;
    std::fputs("words of a library\n", stderr);
    std::fflush(stderr);
    return std::string();
  });
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(here, 1);
}

TEST(ChildProcess, ErrorsOfTheProgramKeepTypeAndMessage) {
  EXPECT_EQ(MessageOfWork<InputError>([] { throw InputError("five axes"); }), "five axes");
  EXPECT_EQ(MessageOfWork<IoError>([] { throw IoError("cut short"); }), "cut short");
}

TEST(ChildProcess, AnyOtherFailureNamesTheLastFile) {
  const std::vector<std::function<void()>> ends = {
      [] { std::abort(); },
      [] { ::raise(SIGSEGV); },
      [] { ::_exit(3); },
      [] { throw std::runtime_error("of a library"); },
      [] { throw std::bad_alloc(); },
  };
  for (const auto& end : ends) {
    EXPECT_THAT(MessageOfWork<IoError>(end),
                AllOf(StartsWith("b.dcm: "), HasSubstr("copy or export it again")));
  }
}

TEST(ChildProcess, MemoryIsLimited) {
#ifdef SEMBLANCE_SANITIZED
  GTEST_SKIP() << "a sanitizer's memory is not limited";
#endif
  EXPECT_THAT(MessageOfWork<IoError>([] {
                std::vector<char> much(static_cast<std::size_t>(4 * kMemory_bytes), 'x');
                EXPECT_EQ(much.back(), 'x');
              }),
              HasSubstr("requires more memory"));
}

TEST(ChildProcess, EndlessWorkIsEnded) {
  const auto endless = [](const ReportFile& report) -> std::string {
    report("a.dcm");
    volatile bool goes_on = true;
    while (goes_on) {
    }
    return "";
  };
  EXPECT_THAT(
      testing::WordsOf<IoError>([&] { RunInChildProcess(endless, {.memory_bytes = 1e6}, {}); }),
      StartsWith("a.dcm: the library that reads it failed or took too long"));
}

TEST(ChildProcess, AStopEndsTheWork) {
  std::stop_source stop;
  const std::jthread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    stop.request_stop();
  });
  const auto endless = [](const ReportFile&) -> std::string {
    for (;;) {
      ::pause();
    }
  };
  EXPECT_THROW(RunInChildProcess(endless, {.memory_bytes = kMemory_bytes}, stop.get_token()),
               Cancelled);
}

// The names of the attempts that succeed in the child.
std::string SuccessesInChild(const std::vector<std::filesystem::path>& readable,
                             const std::map<std::string, std::function<bool()>>& attempts) {
  return RunInChildProcess(
      [&](const ReportFile&) {
        std::string successes;
        for (const auto& [name, attempt] : attempts) {
          successes += attempt() ? name + " " : "";
        }
        return successes;
      },
      {.memory_bytes = kMemory_bytes, .readable = readable}, {});
}

bool CanRead(const std::filesystem::path& path) {
  char byte = 0;
  const int file = ::open(path.c_str(), O_RDONLY);
  return file >= 0 && ::read(file, &byte, 1) == 1;
}

class ConfinedChild : public ::testing::Test {
 protected:
  void SetUp() override {
#if defined(SEMBLANCE_SANITIZED) || defined(SEMBLANCE_COVERAGE)
    GTEST_SKIP() << "a sanitizer or the counters of coverage need these rights";
#endif
    for (const char* name : {"a.dcm", "b.dcm", "all/c.dcm"}) {
      std::filesystem::create_directories((folder_ / name).parent_path());
      std::ofstream(folder_ / name) << "voxels";
    }
  }

  testing::ScratchFolder folder_;
};

TEST_F(ConfinedChild, ReadsItsFilesAndNoOthers) {
  if (!FindConfinement().files) {
    GTEST_SKIP() << "this kernel has no Landlock";
  }
  std::filesystem::create_symlink(folder_ / "a.dcm", folder_ / "link.dcm");
  const auto reads = [&](const char* name) {
    return [=, this] { return CanRead(folder_ / name); };
  };
  const std::vector<std::filesystem::path> readable = {folder_ / "a.dcm", folder_ / "all",
                                                       folder_ / "missing.dcm"};
  EXPECT_EQ(SuccessesInChild(readable, {{"a", reads("a.dcm")},
                                        {"b", reads("b.dcm")},
                                        {"c", reads("all/c.dcm")},
                                        {"link", reads("link.dcm")},
                                        {"library", [] { return CanRead("/usr/lib/os-release"); }},
                                        {"passwords", [] { return CanRead("/etc/passwd"); }},
                                        {"process", [] { return CanRead("/proc/self/environ"); }}}),
            "a c library link ");
}

TEST_F(ConfinedChild, CannotWriteConnectOrStartAnything) {
  if (!FindConfinement().calls) {
    GTEST_SKIP() << "this kernel filters no system calls";
  }
  const std::string a = folder_ / "a.dcm", n = folder_ / "new";
  const pid_t parent = ::getpid();
  const auto opens = [](const std::string& path, int flags) {
    return [=] { return ::open(path.c_str(), flags, 0600) >= 0; };
  };
  const std::map<std::string, std::function<bool()>> attempts = {
      {"write", opens(a, O_WRONLY)},
      {"append", opens(a, O_WRONLY | O_APPEND)},
      {"empty", opens(a, O_RDONLY | O_TRUNC)},
      {"create", opens(n, O_WRONLY | O_CREAT)},
      {"nameless", opens(folder_.Path(), O_WRONLY | O_TMPFILE)},
      {"truncate", [=] { return ::truncate(a.c_str(), 0) == 0; }},
      {"remove", [=] { return ::unlink(a.c_str()) == 0; }},
      {"rename", [=] { return ::rename(a.c_str(), n.c_str()) == 0; }},
      {"link", [=] { return ::symlink(a.c_str(), n.c_str()) == 0; }},
      {"folder", [=] { return ::mkdir(n.c_str(), 0700) == 0; }},
      {"mode", [=] { return ::chmod(a.c_str(), 0777) == 0; }},
      {"internet", [] { return ::socket(AF_INET, SOCK_STREAM, 0) >= 0; }},
      {"local", [] { return ::socket(AF_UNIX, SOCK_STREAM, 0) >= 0; }},
      {"exec", [] { return ::execl("/bin/true", "true", nullptr) == 0; }},
      {"fork", [] { return ::fork() >= 0; }},
      {"signal", [=] { return ::kill(parent, 0) == 0; }},
      {"thread_signal", [=] { return ::syscall(SYS_tgkill, parent, parent, 0) == 0; }},
      {"trace", [=] { return ::ptrace(PTRACE_ATTACH, parent, nullptr, nullptr) == 0; }},
      {"ring", [] { return ::syscall(SYS_io_uring_setup, 1, nullptr) >= 0; }},
      {"terminal", [] { return ::isatty(STDIN_FILENO) != 0; }},
      {"read", [=] { return CanRead(a); }},
      {"thread",
       [] {
         int here = 0;
         std::thread([&] { here = 1; }).join();
         return here == 1;
       }},
      {"memory", [] { return std::vector<char>(50'000'000, 'x').back() == 'x'; }},
  };
  EXPECT_EQ(SuccessesInChild({a}, attempts), "memory read thread ");
  EXPECT_EQ(ReadFileBytes(a), "voxels");
  EXPECT_FALSE(std::filesystem::exists(n));
}

TEST_F(ConfinedChild, HasNoOpenFilesOfItsParent) {
  const int file = ::open((folder_ / "b.dcm").c_str(), O_RDWR);
  ASSERT_GE(file, 0);
  const auto writes = [=] { return ::write(file, "x", 1) == 1; };
  EXPECT_EQ(SuccessesInChild({}, {{"write", writes}}), "");
  ::close(file);
}

}  // namespace
}  // namespace semblance::problems
