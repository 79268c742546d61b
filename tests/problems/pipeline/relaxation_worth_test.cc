// SPDX-License-Identifier: GPL-3.0-or-later
// Is relaxation worth its time? The generic face's (u,v) are wrong by up to 5 % of the domain.
#include <gtest/gtest.h>

#include "fitting/relaxation/dowel_mesh.h"
#include "fitting/relaxation/relaxation.h"
#include "problems/pipeline/experiment_config.h"
#include "problems/run.h"

namespace semblance {
namespace {

struct Worth {
  double rms_mm = kNaN;      // of the face from the true one
  double crease_deg = kNaN;  // the sharpest
};

Worth WorthOf(const std::string& site_error, const std::string& relaxation, StageCache& cache) {
  const auto experiment = ReadConfig<Experiment>(
      std::filesystem::path(SEMBLANCE_SOURCE_DIR) / "configs/phantom.yaml",
      std::vector<std::string>{"subject.rings=40", "implicit.resolution=48", "rounds=2",
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

TEST(RelaxationWorth, ItUndoesWrongParametersWithoutACreaseAndWithoutItTheyStay) {
  StageCache cache(4);
  const Worth exact = WorthOf("0", "none", cache), wrong = WorthOf("0.05", "none", cache),
              relaxed = WorthOf("0.05", "tangent_distance", cache);
  EXPECT_LE(relaxed.rms_mm, 1.1 * exact.rms_mm);
  EXPECT_GT(wrong.rms_mm, 1.1 * exact.rms_mm);
  EXPECT_LE(relaxed.crease_deg, exact.crease_deg + 10);
  EXPECT_GT(wrong.crease_deg, 150);
}

}  // namespace
}  // namespace semblance
