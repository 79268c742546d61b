// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/turntable.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "surfaces/base/error.h"
#include "tests/testing/scratch_folder.h"
#include "tests/testing/small_runs.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(Turntable, HasSkullAndFaceThatTurnAndAFramePerStep) {
  const testing::ScratchFolder scratch;
  testing::WriteSmallRun(scratch / "run", 60);
  const TurntableOptions options{.frames = 4, .seconds = 3, .height_px = 64};
  const Turntable table = MakeTurntable(scratch / "run", options, {});
  for (const char* const word : {R"("name":"skull")", R"("name":"face")", R"("name":"turn")",
                                 R"("path":"rotation")", R"("max":[3.0])"}) {
    EXPECT_THAT(table.glb.substr(0, 20000), HasSubstr(word));
  }
  ASSERT_EQ(table.frames.size(), 4u);
  EXPECT_EQ(table.frames[0].name, "frame_000.png");
  EXPECT_EQ(table.frames[3].name, "frame_003.png");
  // The markers of the skull point to the front: the sides differ from front and back.
  EXPECT_NE(table.frames[0].png, table.frames[1].png);
  EXPECT_NE(table.frames[0].png, table.frames[2].png);
  RunContext threads;
  threads.threads = 3;
  const Turntable again = MakeTurntable(scratch / "run", options, threads);
  EXPECT_EQ(again.glb, table.glb);
  EXPECT_EQ(again.frames[3].png, table.frames[3].png);
}

TEST(Turntable, RefusesOptionsAndFoldersThatCannotBe) {
  const testing::ScratchFolder scratch;
  EXPECT_THAT([&] { MakeTurntable(scratch / "none", {}, {}); },
              ThrowsMessage<IoError>(HasSubstr("not the folder of a run")));
  testing::WriteSmallRun(scratch / "run", 60);
  EXPECT_THAT([&] { MakeTurntable(scratch / "run", {.frames = 0}, {}); },
              ThrowsMessage<InputError>(HasSubstr("1 to 720 frames")));
}

}  // namespace
}  // namespace semblance::problems
