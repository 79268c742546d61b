// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/program_end.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

template <class E>
Failure Describe(const E& error) {
  return DescribeFailure(std::make_exception_ptr(error));
}

TEST(Failure, AnExceptionInAThreadEndsWithItsMessage) {
  const auto end_with = [](auto error) {
    std::set_terminate(&TerminateWithMessage);
    std::thread([&] { throw error; }).join();
  };
  EXPECT_EXIT(end_with(std::bad_alloc()), ::testing::ExitedWithCode(1),
              "semblance: not enough memory; lower");
  EXPECT_EXIT(end_with(InputError("a.ply: no faces")), ::testing::ExitedWithCode(1),
              "semblance: a.ply: no faces");
  EXPECT_EXIT((std::set_terminate(&TerminateWithMessage), std::terminate()),
              ::testing::ExitedWithCode(1), "internal error of the program");
}

TEST(Failure, CorrectableFaultsExitWithTwoAndFailedWorkWithOne) {
  EXPECT_EQ(Describe(InputError("a")).exit_code, 2);
  EXPECT_EQ(Describe(ConfigError("a")).words, "a");
  const std::error_code code = std::make_error_code(std::errc::filename_too_long);
  const Failure path = Describe(std::filesystem::filesystem_error("x", "dir/file", code));
  EXPECT_EQ(path.exit_code, 2);
  EXPECT_EQ(path.words, "dir/file: File name too long");
  EXPECT_EQ(Describe(nlohmann::json::other_error::create(501, "odd", nullptr)).exit_code, 2);
  EXPECT_EQ(Describe(OutOfMemory("lower x")).exit_code, 1);
  EXPECT_THAT(Describe(std::bad_alloc()).words,
              AllOf(HasSubstr("not enough memory"), HasSubstr("lower")));
  EXPECT_EQ(Describe(std::length_error("vector")).exit_code, 1);
  EXPECT_EQ(Describe(std::system_error(code)).exit_code, 1);
  EXPECT_EQ(Describe(Cancelled()).exit_code, 1);
  EXPECT_EQ(Describe(std::runtime_error("library")).words, "the work failed: library");
  EXPECT_EQ(Describe(7).exit_code, 1);
}

TEST(Shortened, KeepsBeginningAndEndOfLongMessages) {
  EXPECT_EQ(Shortened("one\ntwo"), "one\ntwo");
  const std::string long_line = "a.yaml:1:1: " + std::string(90'000, 'x') + "; write y";
  EXPECT_LT(Shortened(long_line).size(), 1100u);
  EXPECT_THAT(Shortened(long_line),
              AllOf(HasSubstr("a.yaml:1:1: xxx"), HasSubstr("89121 bytes left out"),
                    HasSubstr("xxx; write y")));
  std::string lines;
  for (int k = 0; k < 500; ++k) {
    lines += "line\n";
  }
  EXPECT_THAT(Shortened(lines), HasSubstr("... and 451 lines more"));
}

TEST(Shortened, CutsBetweenCharacters) {
  std::string umlauts = "x";
  for (int k = 0; k < 5000; ++k) {
    umlauts += "\u00e4";
  }
  const std::string text = Shortened(umlauts);
  EXPECT_EQ(text.find("\xa4 ["), text.find(" [") - 1);
  EXPECT_THAT(text, Not(HasSubstr("\xc3 [")));
  EXPECT_THAT(text, HasSubstr("] \u00e4"));
}

TEST(Shortened, ReplacesControlCharacters) {
  EXPECT_EQ(Shortened("a\x1b[2Jb\x07\r\t\x7f"), "a?[2Jb????");
}

constexpr unsigned kLongEnough_s = 10;

void EndBySignal(int) { ::_exit(77); }

// Runs after the destruction of static objects.
void RaiseAtTheEnd() {
  std::signal(SIGALRM, &EndBySignal);  // a handler that waits forever ends with 77
  ::alarm(kLongEnough_s);
  std::raise(SIGTERM);
}

TEST(StopSignals, ASignalDuringTheExitDoesNotBlockTheExit) {
  const auto end = [] {
    std::atexit(&RaiseAtTheEnd);
    StopOnSignals();
    std::exit(0);
  };
  EXPECT_EXIT(end(), ::testing::ExitedWithCode(0), "");
}

TEST(StopSignals, TheFirstRequestsAStopAndTheSecondExitsAtOnce) {
  const auto end = [](int signals) {
    const std::stop_token token = StopOnSignals();
    for (int k = 0; k < signals; ++k) {
      std::raise(SIGTERM);
    }
    std::exit(token.stop_requested() ? 0 : 3);
  };
  EXPECT_EXIT(end(0), ::testing::ExitedWithCode(3), "");
  EXPECT_EXIT(end(1), ::testing::ExitedWithCode(0), "");
  EXPECT_EXIT(end(2), ::testing::ExitedWithCode(1), "semblance: stopped");
}

TEST(StopSignals, WorkThatIgnoresTheStopIsEndedAfterASecond) {
  const auto end = [] {
    StopOnSignals();
    std::raise(SIGTERM);
    std::this_thread::sleep_for(std::chrono::seconds(kLongEnough_s));
    std::exit(0);
  };
  EXPECT_EXIT(end(), ::testing::ExitedWithCode(1), "semblance: stopped");
}

}  // namespace
}  // namespace semblance::problems
