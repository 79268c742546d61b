// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/step_clock.h"

#include <gtest/gtest.h>

#include <chrono>
#include <ctime>
#include <thread>
#include <vector>

namespace semblance::problems {
namespace {

constexpr double kWork_s = 0.05;

// Computes until the calling thread has used kWork_s of the processor.
void Work() {
  const auto used_s = [] {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  };
  const double end_s = used_s() + kWork_s;
  while (used_s() < end_s) {
  }
}

void WorkInAnotherThread() { std::thread(Work).join(); }

StepTime TimeOf(int threads, void (*work)()) {
  RunContext context;
  context.threads = threads;
  StepClock step(context);
  step("work", work);
  return step.Take().at(0);
}

TEST(StepClock, WorkTakesProcessorTimeAndSleepTakesOnlyWallTime) {
  const StepTime work = TimeOf(1, Work);
  EXPECT_GE(work.cpu_s, kWork_s);
  EXPECT_GE(work.wall_s, kWork_s * 0.99);  // the two clocks have different steps
  const StepTime sleep =
      TimeOf(1, [] { std::this_thread::sleep_for(std::chrono::duration<double>(kWork_s)); });
  EXPECT_LT(sleep.cpu_s, kWork_s / 2);
  EXPECT_GE(sleep.wall_s, kWork_s * 0.99);
}

TEST(StepClock, AJobWithSeveralThreadsCountsAllAndAnotherOnlyItsOwn) {
  EXPECT_GE(TimeOf(2, WorkInAnotherThread).cpu_s, kWork_s);
  EXPECT_LT(TimeOf(1, WorkInAnotherThread).cpu_s, kWork_s / 2);
}

TEST(StepClock, AStepThatNeedsMemoryRaisesThePeak) {
  constexpr double kMore_mb = 256;
  RunContext context;
  StepClock step(context);
  step("little", [] {});
  const std::size_t bytes = step("much", [] {
    return std::vector<char>(static_cast<std::size_t>(kMore_mb * 1e6), 'x').size();
  });
  EXPECT_EQ(bytes, kMore_mb * 1e6);
  step("little again", [] {});
  const std::vector<StepTime> times = step.Take();
  EXPECT_GT(times[0].peak_mb, 1);
  EXPECT_GE(times[1].peak_mb, kMore_mb);
  EXPECT_GE(times[2].peak_mb, times[1].peak_mb);
}

TEST(StepClock, KeepsEarlierStepsInOrderAndReturnsWhatAStepReturns) {
  const RunContext context;
  StepClock step(context, {{.step = "before"}});
  EXPECT_EQ(step("seven", [] { return 7; }), 7);
  const std::vector<StepTime> times = step.Take();
  ASSERT_EQ(times.size(), 2u);
  EXPECT_EQ(times[0].step, "before");
  EXPECT_EQ(times[1].step, "seven");
}

}  // namespace
}  // namespace semblance::problems
