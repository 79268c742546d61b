// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/child_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kMemory_bytes = 256e6;

std::string Do(const std::function<std::string(const ReportFile&)>& work) {
  return RunInChildProcess(work, kMemory_bytes, {});
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
      testing::WordsOf<IoError>([&] { RunInChildProcess(endless, /*memory_bytes=*/1e6, {}); }),
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
  EXPECT_THROW(RunInChildProcess(endless, kMemory_bytes, stop.get_token()), Cancelled);
}

}  // namespace
}  // namespace semblance::problems
