// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/skull_stage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/experiment/experiment_config.h"

namespace semblance::problems {
namespace {

std::shared_ptr<const DepthStage> PhantomsDepth(const std::string& fill) {
  const RunContext context;
  StageCache cache(4);
  StepClock step(context);
  const std::vector<std::string> overrides = {"subject.rings=30", "fill=" + fill};
  const auto experiment =
      ReadConfig<Experiment>(SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml", overrides);
  return MakeDepthStage(experiment, cache, step, context);
}

// Depth counts from the bone where the shell lies over it. A ray from bone that was not filled must
// not take the other side of a cavity for a shell.
TEST(DepthStage, NamesTheBoneOfAFilledSkullAlone) {
  const auto bare = PhantomsDepth("none"), filled = PhantomsDepth("wrap");
  EXPECT_EQ(bare->Input().bone, nullptr);
  EXPECT_EQ(filled->Input().bone, &filled->subject.skull);
  EXPECT_NE(filled->Input().bone->points.size(), filled->shell.points.size());
}

}  // namespace
}  // namespace semblance::problems
