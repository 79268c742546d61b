// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/program/stop_signals.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

namespace semblance {
namespace {

constexpr unsigned kLongEnough_s = 10;

void EndBySignal(int) { ::_exit(77); }

// What the program is destroyed with is gone when this is called.
void RaiseAtTheEnd() {
  std::signal(SIGALRM, &EndBySignal);  // a handler that waits for ever ends with 77
  ::alarm(kLongEnough_s);
  std::raise(SIGTERM);
}

TEST(StopSignals, OneThatComesAsTheProgramEndsDoesNotKeepItFromEnding) {
  const auto end = [] {
    std::atexit(&RaiseAtTheEnd);
    StopOnSignals();
    std::exit(0);
  };
  EXPECT_EXIT(end(), ::testing::ExitedWithCode(0), "");
}

TEST(StopSignals, TheFirstAsksAndTheSecondEndsAtOnce) {
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

TEST(StopSignals, WorkThatDoesNotSeeTheStopIsEndedAfterASecond) {
  const auto end = [] {
    StopOnSignals();
    std::raise(SIGTERM);
    std::this_thread::sleep_for(std::chrono::seconds(kLongEnough_s));
    std::exit(0);
  };
  EXPECT_EXIT(end(), ::testing::ExitedWithCode(1), "semblance: stopped");
}

}  // namespace
}  // namespace semblance
