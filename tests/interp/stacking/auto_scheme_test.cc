// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/stacking/auto_scheme.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "interp/interpolate_depth.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::Count;
using testing::DomeScene;
using testing::DowelScene;
using ::testing::ElementsAre;
using testing::SameBytes;
using testing::ScatteredScene;

double SumOf(const std::vector<SchemeShare>& shares) {
  return std::accumulate(shares.begin(), shares.end(), 0.0,
                         [](double sum, const SchemeShare& share) { return sum + share.weight; });
}

TEST(AutoScheme, WithOneSchemeIsThatScheme) {
  const DowelScene scene = DomeScene();
  for (const SingleScheme& scheme :
       {SingleScheme{Barycentric{}}, SingleScheme{Kriging{}}, SingleScheme{Harmonic{}}}) {
    const DepthField alone = std::visit(
        [&](const auto& options) { return InterpolateDepth(options, scene.Input(), {}); }, scheme);
    const DepthField field = InterpolateDepth(AutoScheme{.schemes = {scheme}}, scene.Input(), {});
    EXPECT_TRUE(SameBytes(alone, field));
    ASSERT_EQ(field.shares.size(), 1u);
    EXPECT_EQ(field.shares[0].weight, 1);
  }
}

TEST(AutoScheme, IsTheWeightedMeanOfItsSchemesAndReportsTheWeights) {
  const DowelScene scene = ScatteredScene(20);
  const AutoScheme options{.schemes = {Kriging{}, InverseDistance{}, Mean{}}};
  const DepthField field = InterpolateDepth(options, scene.Input(), {});
  ASSERT_EQ(field.shares.size(), 3u);
  EXPECT_NEAR(SumOf(field.shares), 1, 1e-12);
  const DepthField fields[] = {InterpolateDepth(Kriging{}, scene.Input(), {}),
                               InterpolateDepth(InverseDistance{}, scene.Input(), {}),
                               InterpolateDepth(Mean{}, scene.Input(), {})};
  for (std::size_t v = 0; v < field.status.size(); ++v) {
    if (fields[0].status[v] == DepthStatus::kAssigned) {
      double mean = 0;
      for (int k = 0; k < 3; ++k) {
        mean += field.shares[k].weight * fields[k].depth_mm[v];
      }
      ASSERT_NEAR(field.depth_mm[v], mean, 1e-9);
      ASSERT_GT(field.sd_mm[v], 0);
    }
  }
}

TEST(AutoScheme, ChoosesTheBestPredictorOfLeftOutDowels) {
  const DowelScene scene = ScatteredScene(40);
  const DepthField field = InterpolateDepth(
      AutoScheme{.schemes = {Mean{}, Kriging{}, Nearest{}}, .takes = AutoTakes::kBest},
      scene.Input(), {});
  ASSERT_EQ(field.shares.size(), 3u);
  EXPECT_EQ(field.shares[1].scheme, "kriging");
  EXPECT_EQ(field.shares[1].weight, 1);
  const DepthField kriging = InterpolateDepth(Kriging{}, scene.Input(), {});
  for (std::size_t v = 0; v < field.status.size(); ++v) {
    if (kriging.status[v] == DepthStatus::kAssigned) {
      ASSERT_EQ(field.depth_mm[v], kriging.depth_mm[v]);
    }
  }
}

std::vector<std::string> NamesOfShares(const std::vector<SingleScheme>& schemes) {
  const DowelScene scene = ScatteredScene(12);
  std::vector<std::string> names;
  for (const SchemeShare& share :
       InterpolateDepth(AutoScheme{.schemes = schemes}, scene.Input(), {}).shares) {
    names.push_back(share.scheme);
  }
  return names;
}

TEST(AutoScheme, NamesARepeatedSchemeByItsOptions) {
  EXPECT_THAT(NamesOfShares(AutoScheme{}.schemes),
              ElementsAre("radial_basis", "kriging", "kriging matern_5_2"));
  EXPECT_THAT(
      NamesOfShares({InverseDistance{}, InverseDistance{.power = 4}, InverseDistance{.power = 4}}),
      ElementsAre("inverse_distance", "inverse_distance power 4", "inverse_distance power 4 2"));
  EXPECT_THAT(NamesOfShares({Kriging{.length_mm = 30, .clamp = false}, RadialBasis{}}),
              ElementsAre("kriging", "radial_basis"));
  EXPECT_THAT(NamesOfShares({Kriging{.length_mm = 30, .clamp = false}, Kriging{}}),
              ElementsAre("kriging length_mm 30 no clamp", "kriging"));
}

TEST(AutoScheme, SkipsSchemesOnAMissingNetwork) {
  DowelScene scene = DomeScene();
  scene.network.areas.clear();
  const DepthField field = InterpolateDepth(
      AutoScheme{.schemes = {Barycentric{}, Nearest{}, Mean{}}}, scene.Input(), {});
  ASSERT_EQ(field.shares.size(), 2u);
  EXPECT_EQ(field.shares[0].scheme, "nearest");
}

// A rough field whose roughness is visible in the dowels: the stated sd is correct for the bone
// between them. With one of three dowels left out, two remain, which cannot determine a mean of
// three factors.
TEST(AutoScheme, SkipsSchemesWithTooFewRemainingDowels) {
  const DowelScene scene = ScatteredScene(3);
  const Kriging relief{.mean = DepthMean::kCovariates};
  const DepthField field =
      InterpolateDepth(AutoScheme{.schemes = {relief, Mean{}}}, scene.Input(), {});
  ASSERT_EQ(field.shares.size(), 1u);
  EXPECT_EQ(field.shares[0].scheme, "mean");
  const DepthField alone = InterpolateDepth(AutoScheme{.schemes = {relief}}, scene.Input(), {});
  EXPECT_EQ(alone.shares[0].scheme, "kriging");
  EXPECT_EQ(InterpolateDepth(AutoScheme{.schemes = {relief, Mean{}}}, ScatteredScene(4).Input(), {})
                .shares.size(),
            2u);
}

TEST(AutoScheme, StatesAnSdThatHolds) {
  const auto depth_at = [](const Vec3& p) {
    return 12 + 2 * std::sin(p.x() / 9) * std::cos(p.z() / 11) + std::sin((p.x() + p.z()) / 7);
  };
  DowelScene scene = ScatteredScene(60);
  for (Dowel& dowel : scene.dowels) {
    dowel.depth_mm = depth_at(dowel.base);
  }
  const DepthField field = InterpolateDepth(
      AutoScheme{.schemes = {Kriging{}, NaturalNeighbour{}, Nearest{}}}, scene.Input(), {});
  int asked = 0, within = 0;
  for (std::size_t v = 0; v < field.status.size(); ++v) {
    const Vec3& p = scene.skull.points[v];
    if (field.status[v] == DepthStatus::kAssigned && p.y() < -30) {
      ++asked;
      within += std::abs(field.depth_mm[v] - depth_at(p)) <= 1.645 * field.sd_mm[v];
    }
  }
  EXPECT_GT(asked, 300);
  EXPECT_NEAR(static_cast<double>(within) / asked, 0.9, 0.08);
}

}  // namespace
}  // namespace semblance::interp
