// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/study_progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "surfaces/base/atomic_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::ScratchFolder;

TEST(StudyEta, HasRateAndRemainingTimeFromTheTrialsOfThisCall) {
  EXPECT_EQ(EtaText({.trials = 80, .finished = 30, .finished_before = 20, .elapsed_s = 40}),
            "30 of 80 trials, 4.0 s each, about 3 min left");
  EXPECT_EQ(EtaText({.trials = 80, .finished = 21, .finished_before = 1, .elapsed_s = 4}),
            "21 of 80 trials, 5.0 a second, about 12 s left");
  EXPECT_EQ(EtaText({.trials = 8, .finished = 8, .failed = 2, .elapsed_s = 16}),
            "8 of 8 trials, 2.0 s each; 2 failed");
  EXPECT_EQ(EtaText({.trials = 8, .finished = 3, .finished_before = 3}), "3 of 8 trials");
  EXPECT_EQ(EtaText({.trials = 8, .finished = 3, .finished_before = 3, .elapsed_s = 75}),
            "3 of 8 trials, 75 s so far");
}

TEST(StudyEta, TheBarFillsFromEmptyToFull) {
  EXPECT_EQ(BarText({.trials = 4, .finished = 0}, 8), "[........]");
  EXPECT_EQ(BarText({.trials = 4, .finished = 3}, 8), "[######..]");
  EXPECT_EQ(BarText({.trials = 4, .finished = 4}, 8), "[########]");
  EXPECT_EQ(BarText({.trials = 0}, 4), "[####]");
}

TEST(StudyProgress, WithoutATerminalPrintsFailuresAndTheEnd) {
  const ScratchFolder folder;
  std::FILE* file = std::fopen((folder / "log").c_str(), "w");
  StudyProgress progress(file, std::chrono::hours(1));
  for (int n = 1; n <= 1000; ++n) {
    progress({.trials = 1000, .finished = n, .failed = n >= 500 ? 1 : 0, .elapsed_s = 0.1 * n},
             "failed: a mean: no skull");
  }
  progress({.trials = 1000, .finished = 1000, .failed = 1, .elapsed_s = 101}, "");
  std::fclose(file);
  const std::string log = ReadFileBytes(folder / "log");
  EXPECT_EQ(log, "failed: a mean: no skull\n1000 of 1000 trials, 10.0 a second; 1 failed\n");
}

}  // namespace
}  // namespace semblance::problems
