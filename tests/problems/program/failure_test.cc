// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/program/failure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <new>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

template <class E>
Failure Of(const E& error) {
  return FailureOf(std::make_exception_ptr(error));
}

TEST(Failure, WhatEscapesFromAThreadEndsInWordsToo) {
  const auto end_with = [](auto error) {
    std::set_terminate(&EndInWords);
    std::thread([&] { throw error; }).join();
  };
  EXPECT_EXIT(end_with(std::bad_alloc()), ::testing::ExitedWithCode(1),
              "semblance: not enough memory; lower");
  EXPECT_EXIT(end_with(InputError("a.ply: no faces")), ::testing::ExitedWithCode(1),
              "semblance: a.ply: no faces");
  EXPECT_EXIT((std::set_terminate(&EndInWords), std::terminate()), ::testing::ExitedWithCode(1),
              "a fault of the program itself");
}

TEST(Failure, WhatTheUserCanMendIsTwoAndWorkThatFailedIsOne) {
  EXPECT_EQ(Of(InputError("a")).exit_code, 2);
  EXPECT_EQ(Of(ConfigError("a")).words, "a");
  const std::error_code code = std::make_error_code(std::errc::filename_too_long);
  const Failure path = Of(std::filesystem::filesystem_error("x", "dir/file", code));
  EXPECT_EQ(path.exit_code, 2);
  EXPECT_EQ(path.words, "dir/file: File name too long");
  EXPECT_EQ(Of(nlohmann::json::other_error::create(501, "odd", nullptr)).exit_code, 2);
  EXPECT_EQ(Of(OutOfMemory("lower x")).exit_code, 1);
  EXPECT_THAT(Of(std::bad_alloc()).words,
              AllOf(HasSubstr("not enough memory"), HasSubstr("lower")));
  EXPECT_EQ(Of(std::length_error("vector")).exit_code, 1);
  EXPECT_EQ(Of(std::system_error(code)).exit_code, 1);
  EXPECT_EQ(Of(Cancelled()).exit_code, 1);
  EXPECT_EQ(Of(std::runtime_error("library")).words, "the work failed: library");
  EXPECT_EQ(Of(7).exit_code, 1);
}

TEST(Shortened, KeepsBeginningAndEndOfWhatIsTooLong) {
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

TEST(Shortened, CutsNoCharacterInTwo) {
  std::string umlauts = "x";
  for (int k = 0; k < 5000; ++k) {
    umlauts += "\u00e4";
  }
  const std::string text = Shortened(umlauts);
  EXPECT_EQ(text.find("\xa4 ["), text.find(" [") - 1);
  EXPECT_THAT(text, Not(HasSubstr("\xc3 [")));
  EXPECT_THAT(text, HasSubstr("] \u00e4"));
}

TEST(Shortened, DoesNotLetANameDriveTheTerminal) {
  EXPECT_EQ(Shortened("a\x1b[2Jb\x07\r\t\x7f"), "a?[2Jb????");
}

}  // namespace
}  // namespace semblance
