// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/spring_face.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "problems/experiment/experiment_config.h"
#include "problems/run.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/scratch_file.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using testing::WordsOf;

RunResult RunSpringPhantom(const std::string& face, int threads = 1) {
  static StageCache cache(8);
  RunContext context;
  context.threads = threads;
  const std::vector<std::string> overrides = {"subject.rings=24", "implicit.resolution=28",
                                              "face=" + face};
  return problems::Run(
      ReadConfig<Experiment>(SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml", overrides), context,
      &cache);
}

// The median distance of the face from the implicit face, where bone shows it.
double MedianFromImplicit_mm(const RunResult& result) {
  const MeshQuery face(result.face.mesh);
  std::vector<double> distances;
  for (const Vec3& p : result.implicit.mesh.points) {
    distances.push_back(face.Closest(p).distance_mm);
  }
  std::ranges::sort(distances);
  return distances[distances.size() / 4];  // half of the implicit face is behind the face
}

double DistanceOfTips_mm(const RunResult& result) {
  const MeshQuery face(result.face.mesh);
  double squares = 0;
  for (const Dowel& dowel : result.subject.dowels_on_bone) {
    squares += std::pow(face.Closest(dowel.Tip()).distance_mm, 2);
  }
  return std::sqrt(squares / static_cast<double>(result.subject.dowels_on_bone.size()));
}

const RunResult& SpringRun() {
  static const RunResult run = RunSpringPhantom("springs");
  return run;
}

TEST(SpringFace, TheNetComesToTheDepthAndStaysAtTheTipsThorough) {
  const RunResult& springs = SpringRun();
  const RunResult start = RunSpringPhantom("{type: thin_plate, stiffness_mm: 0}");
  ASSERT_TRUE(springs.usable());
  EXPECT_LT(MedianFromImplicit_mm(springs), 0.7 * MedianFromImplicit_mm(start));
  EXPECT_LT(DistanceOfTips_mm(springs), 1);
  EXPECT_LT(springs.truth->face.truth_to_face.mean_abs_mm,
            start.truth->face.truth_to_face.mean_abs_mm);
  EXPECT_FALSE(springs.uncertainty) << "no sigma is known of such a face";
  ASSERT_EQ(springs.fit.levels.size(), 1u);
  const LevelSummary& level = springs.fit.levels[0];
  EXPECT_EQ(level.solver, "ceres");
  ASSERT_EQ(level.terms.size(), 3u);
  EXPECT_LT(level.terms[1].after, level.terms[1].before) << "depth";
}

TEST(SpringFace, TheNumberOfThreadsChangesNoByteThorough) {
  const RunResult &one = SpringRun(), three = RunSpringPhantom("springs", 3);
  EXPECT_EQ(one.fit.surface.Offsets(), three.fit.surface.Offsets());
  EXPECT_EQ(one.fit.surface.Net(0).vertices, three.fit.surface.Net(0).vertices);
}

TEST(SpringFace, ALevelThatTheTemplateLacksIsRefused) {
  EXPECT_THAT(
      WordsOf<ConfigError>([] {
        ReadConfigText<Experiment>(
            "template: {type: formula, max_level: 1}\nfit: {plan: {schedule: [{level: 0}]}}\n"
            "face: {type: springs, level: 2}\n",
            "a.yaml");
      }),
      HasSubstr("a.yaml:3:30: face.level: level 2 is finer than the surface"));
}

// Of a face without sigma no faces can be drawn.
TEST(SpringFace, SamplesAreRefused) {
  EXPECT_THAT(WordsOf<ConfigError>([] {
                ReadConfigText<Experiment>("face: springs\nuncertainty: {samples: 2}\n", "a.yaml");
              }),
              HasSubstr("uncertainty.samples: `face: springs` does not use it"));
}

}  // namespace
}  // namespace semblance::problems
