// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/external_scheme.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "interp/interpolate_depth.h"
#include "surfaces/base/error.h"
#include "tests/testing/dowel_scenes.h"
#include "tests/testing/scratch_file.h"

namespace semblance::interp {
namespace {

using ::testing::HasSubstr;

using Options = std::map<std::string, std::string>;
using Function = std::function<ExternalDepths(const DepthInput&, const Options&)>;

ExternalScheme MakeScheme(Function function) {
  return {.name = "mine",
          .source_hash = "0",
          .options = {{"power", "3"}},
          .function = std::make_shared<const ExternalFunction>(
              ExternalFunction{.interpolate = std::move(function)})};
}

ExternalScheme EqualDepth(double depth_mm) {
  return MakeScheme([depth_mm](const DepthInput& input, const Options&) {
    return ExternalDepths{std::vector<double>(input.skull.points.size(), depth_mm), {}};
  });
}

// ShepardDepth's weights in their textbook form.
ExternalDepths ShepardDepth(const DepthInput& input, const Options& options) {
  const double power = std::stod(options.at("power"));
  ExternalDepths depths;
  for (const Vec3& p : input.skull.points) {
    double sum = 0, weights = 0;
    for (const Dowel& dowel : input.dowels) {
      const double weight = std::pow(std::max((p - dowel.base).norm(), 1e-9), -power);
      sum += weight * dowel.depth_mm;
      weights += weight;
    }
    depths.depth_mm.push_back(sum / weights);
  }
  return depths;
}

std::string ErrorOf(const ExternalScheme& scheme) {
  const testing::DowelScene scene = testing::FlatScene();
  return testing::WordsOf<InputError>(
      [&] { InterpolateDepth(DepthScheme(scheme), scene.Input(), RunContext{}); });
}

TEST(ExternalScheme, EqualsTheBuiltInSchemeOfTheSameFormula) {
  const testing::DowelScene scene = testing::FlatScene();
  const DepthField own =
      InterpolateDepth(DepthScheme(MakeScheme(&ShepardDepth)), scene.Input(), {});
  const DepthField built_in = InterpolateDepth(
      DepthScheme(InverseDistance{.power = 3, .max_angle_deg = 180}), scene.Input(), {});
  for (std::size_t v = 0; v < own.depth_mm.size(); ++v) {
    EXPECT_NEAR(own.depth_mm[v], built_in.depth_mm[v], 1e-6) << v;
    EXPECT_EQ(own.status[v], DepthStatus::kAssigned);
    EXPECT_TRUE(std::isnan(own.sd_mm[v]));
  }
}

TEST(ExternalScheme, GivesNoDepthWhereTheFunctionReturnsNan) {
  const testing::DowelScene scene = testing::FlatScene();
  const DepthField field = InterpolateDepth(EqualDepth(kNaN), scene.Input(), {});
  EXPECT_EQ(testing::Count(field, DepthStatus::kOutside), static_cast<int>(field.depth_mm.size()));
}

TEST(ExternalScheme, RefusesEveryWrongResultWithItsVertex) {
  EXPECT_THAT(ErrorOf(EqualDepth(-2)),
              HasSubstr("mine: the depth of vertex 0 is -2 mm; return a finite number above 0"));
  EXPECT_THAT(ErrorOf(EqualDepth(0)), HasSubstr("vertex 0"));
  EXPECT_THAT(ErrorOf(EqualDepth(INFINITY)), HasSubstr("vertex 0"));
  EXPECT_THAT(ErrorOf(MakeScheme([](const DepthInput&, const Options&) {
                return ExternalDepths{{1, 2}, {}};
              })),
              HasSubstr("returned 2 depths for"));
  EXPECT_THAT(ErrorOf(MakeScheme([](const DepthInput& input, const Options&) {
                const std::vector<double> ones(input.skull.points.size(), 1);
                return ExternalDepths{ones, std::vector<double>(ones.size(), -1)};
              })),
              HasSubstr("the standard deviation of vertex 0 is -1 mm"));
}

TEST(ExternalScheme, RefusesToRunWithoutItsFunctionOrItsNetwork) {
  EXPECT_THAT(ErrorOf({.name = "mine"}),
              HasSubstr("'mine' is written in Python and is not loaded"));
  ExternalScheme scheme = EqualDepth(5);
  auto function = *scheme.function;
  function.needs_network = true;
  scheme.function = std::make_shared<const ExternalFunction>(function);
  testing::DowelScene scene = testing::FlatScene();
  scene.network.areas.clear();
  EXPECT_THROW(InterpolateDepth(scheme, scene.Input(), {}), InputError);
}

}  // namespace
}  // namespace semblance::interp
