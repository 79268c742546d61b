// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/metrics/feature_distortion.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "problems/pipeline/experiment_config.h"
#include "problems/run.h"

namespace semblance {
namespace {

double StrainOfFeatures(const std::string& rule) {
  const auto config = std::filesystem::path(SEMBLANCE_SOURCE_DIR) / "configs/phantom.yaml";
  const std::vector<std::string> overrides = {"subject.rings=40", "implicit.resolution=48",
                                              "uncertainty.sigma=false",
                                              fmt::format("fit.features={}", rule)};
  const RunResult result = Run(ReadConfig<Experiment>(config, overrides), {});
  const FeatureDistortion& all = *(result.features.end() - 2);
  EXPECT_EQ(all.part, "features");
  return all.distortion.rms_strain;
}

// What strains features is the coarse level, which has too few vertices to bend only around them;
// their own finer vertices take some of it back, the less the more they are held (docs/fit.md).
TEST(FeatureDistortion, TheMoreTheirOffsetsAreHeldTheMoreFeaturesAreStrained) {
  const double free = StrainOfFeatures("free"), weighted = StrainOfFeatures("weighted"),
               frozen = StrainOfFeatures("frozen"), restored = StrainOfFeatures("restore");
  EXPECT_LT(free, weighted);
  EXPECT_LT(weighted, frozen);
  EXPECT_LT(frozen, restored);
}

}  // namespace
}  // namespace semblance
