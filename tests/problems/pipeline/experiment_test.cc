// SPDX-License-Identifier: GPL-3.0-or-later
// Options that are right each by itself but not together.
#include "problems/pipeline/experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/pipeline/experiment_config.h"
#include "tests/testing/scratch_file.h"

namespace semblance {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;
using testing::WordsOf;

std::string Faults(const std::string& text) {
  return WordsOf<ConfigError>([&] { ReadConfigText<Experiment>(text, "a.yaml"); });
}

TEST(Experiment, TheDefaultsFitTogether) { EXPECT_THAT(FaultsBetween(Experiment{}), IsEmpty()); }

TEST(Experiment, AStepAtALevelThatTheFaceLacksIsToldAtItsLine) {
  EXPECT_EQ(Faults("template: {max_level: 2}\n"
                   "fit:\n"
                   "  schedule:\n"
                   "    - {level: 2, fraction: 1}\n"
                   "    - {level: 3, fraction: 1}\n"),
            "a.yaml:5:15: fit.schedule[1].level: level 3 is finer than the generic face, whose "
            "finest level is 2; give a level up to that, or raise template.max_level");
}

TEST(Experiment, AllOptionsThatNameALevelAreLookedAt) {
  EXPECT_THAT(Faults("first_fit: [{level: 4}]\n"), HasSubstr("1:21: first_fit[0].level: level 4"));
  EXPECT_THAT(Faults("seeds: {direction_level: 5}\n"),
              HasSubstr("1:26: seeds.direction_level: level 5"));
  EXPECT_THAT(Faults("fit: {plan: {type: coarse_to_fine, finest: 6}}\n"),
              HasSubstr("1:44: fit.plan.finest: level 6"));
}

TEST(Experiment, AFaultOfADefaultIsToldWhereTheFileComesNearest) {
  EXPECT_THAT(Faults("template: {max_level: 1}\n"),
              AllOf(StartsWith("a.yaml:1:1: fit.schedule[2].level: level 2"),
                    HasSubstr("fit.schedule[5].level")));
}

}  // namespace
}  // namespace semblance
