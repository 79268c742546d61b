// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pipeline/hand_edits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/edits/edit_script.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/run.h"
#include "surfaces/base/atomic_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

// Quick: the generic face, only placed.
Experiment PlacedPhantom(std::vector<std::string> overrides) {
  overrides.insert(overrides.end(), {"subject.rings=20", "implicit.resolution=24", "face=placed"});
  return ReadConfig<Experiment>(SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml", overrides);
}

TEST(HandEdits, ARunReplaysItsScriptAndSaysSo) {
  const testing::ScratchFolder folder;
  WriteFileAtomically(folder / "mine.yaml", "edits: [{level: 2, i: 9, j: 9, offset: [0, 0, 6]}]\n");
  StageCache cache(8);
  const RunResult plain = semblance::Run(PlacedPhantom({}), {}, &cache);
  const RunResult edited =
      semblance::Run(PlacedPhantom({"edits=" + (folder / "mine.yaml").string()}), {}, &cache);
  HSplineSurface wanted = plain.fit.surface;
  ApplyEdits(ReadEditScript(folder / "mine.yaml"), wanted);
  EXPECT_EQ(edited.fit.surface.Offsets(), wanted.Offsets());
  EXPECT_NE(plain.fit.surface.Offsets(), wanted.Offsets());
  EXPECT_THAT(edited.subject.notes, Contains(HasSubstr("changed by hand")));
  EXPECT_THAT(edited.subject.inputs, Contains(folder / "mine.yaml"));
  for (std::size_t k = 0; k < edited.target.points.size(); ++k) {
    EXPECT_EQ(edited.fit.residual_mm[k],
              (wanted.Point(edited.fit.uv[k]) - edited.target.points[k].position).norm());
  }
}

}  // namespace
}  // namespace semblance
