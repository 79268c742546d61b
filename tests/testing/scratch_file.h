// SPDX-License-Identifier: GPL-3.0-or-later
// Small text files for tests of readers, and the messages of exceptions.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "surfaces/base/error.h"

namespace semblance::testing {
using namespace problems;

// Writes `text` to a file named after the running test.
inline std::filesystem::path ScratchFile(std::string_view text) {
  const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
  const std::filesystem::path path =
      std::filesystem::path(::testing::TempDir()) /
      (std::string(info->test_suite_name()) + "_" + info->name() + ".yaml");
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

// The message of the exception E that `action` throws. The test fails if it throws none.
template <class E, class Action>
std::string WordsOf(Action&& action) {
  try {
    action();
  } catch (const E& error) {
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

}  // namespace semblance::testing
