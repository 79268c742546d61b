// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/uncertainty.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "interp/evaluation/scores.h"
#include "problems/config/config.h"
#include "problems/run.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

const std::string kPhantom = SEMBLANCE_SOURCE_DIR "/configs/phantom.yaml";

// The tests share their phantoms and their runs.
const RunResult& RunPhantom(std::vector<std::string> overrides) {
  static StageCache cache(8);
  static std::map<std::vector<std::string>, RunResult> runs;
  overrides.insert(overrides.begin(),
                   {"subject.rings=24", "implicit.resolution=24", "template.max_level=2"});
  if (const auto found = runs.find(overrides); found != runs.end()) {
    return found->second;
  }
  const auto experiment = ReadConfig<Experiment>(kPhantom, overrides);
  return runs.emplace(overrides, problems::Run(experiment, {}, &cache)).first->second;
}

double MedianSigma(const RunResult& result) { return result.uncertainty->median_mm; }

// The exact face of phantoms lies in the 90 % interval of the recovered one on nine tenths of its
// area.
TEST(Uncertainty, NinetyPercentIntervalsHoldNineTenthsOfThePhantomsFacesThorough) {
  double share = 0, area = 0;
  for (const int random_seed : {1, 2}) {
    const RunResult& result = RunPhantom({fmt::format("subject.random_seed={}", random_seed)});
    ASSERT_TRUE(result.truth);
    const SigmaCoverage& sigma = result.truth->sigma;
    EXPECT_GT(sigma.at_90, 0.7) << random_seed;
    share += sigma.at_90 * sigma.area_cm2;
    area += sigma.area_cm2;
  }
  EXPECT_GT(area, 2 * 150);
  EXPECT_GT(share / area, 0.85);
  EXPECT_LT(share / area, 0.95);
}

TEST(Uncertainty, GrowsWithTheDowels) {
  const RunResult &exact = RunPhantom({"subject.random_seed=1"}),
                  &measured = RunPhantom({"uncertainty.dowel_sd_mm=4"});
  EXPECT_EQ(exact.fit.surface.Net(0).vertices, measured.fit.surface.Net(0).vertices);
  EXPECT_GT(MedianSigma(measured), std::hypot(MedianSigma(exact), 3));
  EXPECT_LT(MedianSigma(measured), std::hypot(MedianSigma(exact), 5));
}

TEST(Uncertainty, HasOnlyTheRequestedParts) {
  const RunResult& none = RunPhantom({"uncertainty.sigma=false"});
  EXPECT_FALSE(none.uncertainty);
  const RunResult& two = RunPhantom({"uncertainty.sigma=false", "uncertainty.samples=2"});
  ASSERT_EQ(two.uncertainty->samples.size(), 2u);
  EXPECT_TRUE(two.uncertainty->sigma_mm.empty());
  EXPECT_NE(two.uncertainty->samples[0].Offsets(), two.uncertainty->samples[1].Offsets());
}

TEST(Uncertainty, ATermThatIsLeftOutIsNotedThorough) {
  const RunResult& result =
      RunPhantom({"fit.terms=[points, smoothness, membrane, {type: symmetry, weight: 0.1}]"});
  EXPECT_THAT(result.uncertainty->left_out, ::testing::ElementsAre("symmetry"));
  EXPECT_THAT(result.subject.notes, ::testing::Contains(::testing::HasSubstr("'symmetry'")));
}

// Two spheres lie 1.5 mm apart and sigma is 2 mm: the 70 % interval covers all, the 30 % one
// nothing.
TEST(Uncertainty, CoverageIsTheShareOfTheSkinWithin) {
  const TriMesh skin = testing::SphereMesh({0, 0, 0}, 80, 30),
                face = testing::SphereMesh({0, 0, 0}, 81.5, 30);
  const std::vector<double> apart(skin.points.size(), 1.5), sigma(face.points.size(), 2.0);
  const SigmaCoverage all = MeasureCoverage({skin, apart}, face, sigma, {}, {});
  EXPECT_EQ(all.at_90, 1);
  EXPECT_EQ(all.curve[5], 0);   // 30 %
  EXPECT_EQ(all.curve[13], 1);  // 70 %
  EXPECT_NEAR(all.area_cm2, Area(skin) / 100, 1e-9);
  EXPECT_TRUE(all.of_part.empty());
  EXPECT_NEAR(all.scores.crps_mm, GaussianCrps_mm(1.5, 2), 1e-9);
  EXPECT_NEAR(all.scores.interval_score_90_mm, GaussianIntervalScore_mm(1.5, 2, 0.9), 1e-9);
  const std::vector<Sphere> mask = {{.center = {0, 0, 81.5}, .radius_mm = 200}};
  EXPECT_TRUE(std::isnan(MeasureCoverage({skin, apart}, face, sigma, mask, {}).at_90));
}

// The upper halves are 1.5 mm apart, the lower ones 6 mm. Sigma is 2 mm everywhere.
TEST(Uncertainty, CoverageIsMeasuredByPart) {
  const TriMesh skin = testing::SphereMesh({0, 0, 0}, 80, 30),
                face = testing::SphereMesh({0, 0, 0}, 81.5, 30);
  std::vector<double> apart;
  std::vector<int> part;
  for (const Vec3& p : skin.points) {
    apart.push_back(p.z() > 0 ? 1.5 : 6);
    part.push_back(p.z() > 0 ? 0 : 2);
  }
  const std::vector<double> sigma(face.points.size(), 2.0);
  const SigmaCoverage both = MeasureCoverage({skin, apart, part}, face, sigma, {}, {});
  EXPECT_THAT(both.of_part,
              ::testing::ElementsAre(::testing::Pair("forehead", 1), ::testing::Pair("nose", 0)));
}

}  // namespace
}  // namespace semblance::problems
