// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/make_face.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fitting/relaxation/dowel_mesh.h"
#include "fitting/relaxation/relaxation.h"
#include "problems/experiment/experiment_config.h"
#include "problems/face/edit_script.h"
#include "problems/run.h"
#include "surfaces/base/atomic_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

// The generic face is only placed, which is quick.
Experiment PlacedPhantom(std::vector<std::string> overrides) {
  overrides.insert(overrides.end(), {"subject.rings=20", "implicit.resolution=16",
                                     "template.max_level=2", "face=placed"});
  return ReadConfig<Experiment>(SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml", overrides);
}

TEST(HandEdits, ARunReplaysItsScriptAndNotesIt) {
  const testing::ScratchFolder folder;
  WriteFileAtomically(folder / "mine.yaml", "edits: [{level: 2, i: 9, j: 9, offset: [0, 0, 6]}]\n");
  StageCache cache(8);
  const RunResult plain = problems::Run(PlacedPhantom({}), {}, &cache);
  const RunResult edited =
      problems::Run(PlacedPhantom({"edits=" + (folder / "mine.yaml").string()}), {}, &cache);
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

// Is relaxation worth its time? The generic face's (u,v) are wrong by up to 5 % of the domain.
struct Worth {
  double rms_mm = kNaN;      // of the face from the true one
  double crease_deg = kNaN;  // the sharpest
};

Worth WorthOf(const std::string& site_error, const std::string& relaxation, StageCache& cache) {
  const auto experiment = ReadConfig<Experiment>(
      std::filesystem::path(SEMBLANCE_SOURCE_DIR) / "configs/phantom.yaml",
      std::vector<std::string>{"subject.rings=40", "implicit.resolution=36", "rounds=2",
                               "template.max_level=2",
                               "fit.plan.schedule=[{level: 0, fraction: 1}, {level: 1, fraction: "
                               "1}, {level: 2, fraction: 1}]",
                               "uncertainty.sigma=false", "template.site_error=" + site_error,
                               "fit.relaxation=" + relaxation});
  const RunResult run = Run(experiment, {}, &cache);
  std::vector<Vec2> uv;
  for (const FitPoint& p : run.target.points) {
    uv.push_back(p.uv);
  }
  const DowelMesh mesh(run.placed.surface, uv);
  return {run.truth->face.truth_to_face.rms_mm,
          SharpestCrease_deg(run.fit.surface, mesh, run.fit.uv)};
}

TEST(RelaxationWorthThorough, ItUndoesWrongParametersWithoutACreaseAndWithoutItTheyStay) {
  StageCache cache(4);
  const Worth exact = WorthOf("0", "none", cache), wrong = WorthOf("0.05", "none", cache),
              relaxed = WorthOf("0.05", "tangent_distance", cache);
  EXPECT_LE(relaxed.rms_mm, 1.1 * exact.rms_mm);
  EXPECT_GT(wrong.rms_mm, 1.1 * exact.rms_mm);
  EXPECT_LE(relaxed.crease_deg, exact.crease_deg + 10);
  EXPECT_GT(wrong.crease_deg, 150);
}

}  // namespace
}  // namespace semblance::problems
