// SPDX-License-Identifier: GPL-3.0-or-later
// The laws of every scheme in the variant, and further laws of nearest and mean.
#include "interp/interpolate_depth.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <type_traits>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::Count;
using testing::DomeScene;
using testing::DowelScene;
using testing::FlatScene;
using testing::Moved;
using testing::SameBytes;
using testing::ScatteredScene;

template <std::size_t... Index>
std::vector<DepthScheme> Defaults(std::index_sequence<Index...>) {
  return {std::variant_alternative_t<Index, DepthScheme>{}...};
}

constexpr std::size_t kAlternatives = std::variant_size_v<DepthScheme> - 3;
static_assert(
    std::is_same_v<std::variant_alternative_t<kAlternatives, DepthScheme>, PopulationDepth>);
static_assert(std::is_same_v<std::variant_alternative_t<kAlternatives + 1, DepthScheme>, DepthMap>);
static_assert(
    std::is_same_v<std::variant_alternative_t<kAlternatives + 2, DepthScheme>, ExternalScheme>);

// Every scheme with its defaults, except those that do not live by the dowels alone: population,
// which needs a face's bone (population_depth_test), a map, which comes from a file
// (depth_map_test), and a scheme of the caller (external_scheme_test). Then with options that
// change the method.
std::vector<DepthScheme> Schemes() {
  std::vector<DepthScheme> schemes = Defaults(std::make_index_sequence<kAlternatives>{});
  const DowelDistance along = DowelDistance::kGeodesic;
  schemes.emplace_back(Nearest{.distance = along});
  schemes.emplace_back(InverseDistance{.distance = along});
  schemes.emplace_back(RadialBasis{.kernel = RadialKernel::kCubic});
  schemes.emplace_back(RadialBasis{.kernel = RadialKernel::kGaussian});
  schemes.emplace_back(RadialBasis{.kernel = RadialKernel::kWendlandC2, .tail_degree = 0});
  schemes.emplace_back(Kriging{.covariance = Covariance::kSquaredExponential});
  schemes.emplace_back(Kriging{.covariance = Covariance::kMatern12, .state_sd = false});
  schemes.emplace_back(Kriging{.distance = along});
  schemes.emplace_back(Kriging{.mean = DepthMean::kCovariates, .state_sd = false});
  schemes.emplace_back(SurfaceMatern{.alpha = 1, .edge_mm = 12, .state_sd = false});
  schemes.emplace_back(SurfaceMatern{.alpha = 3, .fit_nugget = true, .state_sd = false});
  schemes.emplace_back(NaturalNeighbour{.weights = NeighbourWeights::kLaplace});
  return schemes;
}

class EveryScheme : public ::testing::TestWithParam<DepthScheme> {
 protected:
  DepthField FieldOf(const DowelScene& scene, int threads = 1) const {
    return InterpolateDepth(GetParam(), scene.Input(), testing::OnThreads(threads));
  }
  std::string ErrorOf(const DowelScene& scene) const {
    try {
      FieldOf(scene);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  }
};
INSTANTIATE_TEST_SUITE_P(DepthScheme, EveryScheme, ::testing::ValuesIn(Schemes()),
                         [](const auto& each) {
                           const auto name =
                               std::visit([](const auto& o) { return o.kName; }, each.param);
                           return each.index < kAlternatives
                                      ? std::string(name)
                                      : fmt::format("{}_{}", name, each.index);
                         });

TEST_P(EveryScheme, DepthIsFiniteAndWithinTheDowelsWhereAssignedAndElsewhereNone) {
  const DowelScene scene = DomeScene();
  const DepthField field = FieldOf(scene);
  ASSERT_EQ(field.depth_mm.size(), scene.skull.points.size());
  ASSERT_EQ(field.status.size(), scene.skull.points.size());
  ASSERT_EQ(field.sd_mm.size(), scene.skull.points.size());
  EXPECT_GT(Count(field, DepthStatus::kAssigned), 100);
  for (std::size_t i = 0; i < field.status.size(); ++i) {
    if (field.status[i] == DepthStatus::kAssigned) {
      ASSERT_GE(field.depth_mm[i], 4.5);
      ASSERT_LE(field.depth_mm[i], 11);
    } else {
      ASSERT_TRUE(std::isnan(field.depth_mm[i]));
    }
  }
}

TEST_P(EveryScheme, TheOrderOfTheDowelsDoesNotMatter) {
  const DowelScene scene = DomeScene();
  DowelScene other = scene;
  const std::vector<int> order = {3, 0, 4, 2, 1};  // other.dowels[i] is scene.dowels[order[i]]
  std::vector<int> place(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    other.dowels[i] = scene.dowels[order[i]];
    place[order[i]] = static_cast<int>(i);
  }
  for (auto& area : other.network.areas) {
    area = {place[area[1]], place[area[2]], place[area[0]]};
  }
  const DepthField a = FieldOf(scene), b = FieldOf(other);
  EXPECT_EQ(a.status, b.status);
  for (std::size_t i = 0; i < a.status.size(); ++i) {
    if (a.status[i] == DepthStatus::kAssigned) {
      ASSERT_NEAR(a.depth_mm[i], b.depth_mm[i], 1e-9);
    }
  }
}

TEST_P(EveryScheme, TheNumberOfThreadsDoesNotMatter) {
  const DowelScene scene = DomeScene();
  EXPECT_TRUE(SameBytes(FieldOf(scene, 1), FieldOf(scene, 2)));
}

TEST_P(EveryScheme, ARigidMotionDoesNotMatter) {
  const DowelScene scene = DomeScene();
  const Mat3 rotation =
      Eigen::AngleAxisd(1.1, Vec3(0.4, -0.3, 0.85).normalized()).toRotationMatrix();
  const DepthField a = FieldOf(scene);
  const DepthField b =
      FieldOf(Moved(scene, {.rotation = rotation, .translation = Vec3(300, -120, 45)}));
  EXPECT_EQ(a.status, b.status);
  for (std::size_t i = 0; i < a.status.size(); ++i) {
    if (a.status[i] == DepthStatus::kAssigned) {
      ASSERT_NEAR(a.depth_mm[i], b.depth_mm[i], 1e-6);
    }
  }
}

// The largest error at a dowel that is at a vertex and has no sd; none for schemes that smooth.
std::optional<double> MissAtDowels_mm(const DepthScheme& scheme) {
  return std::visit(
      [](const auto& o) -> std::optional<double> {
        const std::string_view name = o.kName;
        if (name == "mean" || name == "moving_least_squares" || name == "harmonic") {
          return std::nullopt;
        }
        if constexpr (requires { o.fit_nugget; }) {
          if (o.fit_nugget) {
            return std::nullopt;
          }
        }
        return 1e-6;
      },
      scheme);
}

TEST_P(EveryScheme, InterpolatesTheDowelsUnlessItSmooths) {
  DowelScene scene = DomeScene();
  for (Dowel& dowel : scene.dowels) {
    dowel.base = *std::ranges::min_element(scene.skull.points, {},
                                           [&](const Vec3& p) { return (p - dowel.base).norm(); });
    dowel.sd_mm = kNaN;
  }
  const std::optional<double> miss = MissAtDowels_mm(GetParam());
  const DepthField field = FieldOf(scene);
  for (const Dowel& dowel : scene.dowels) {
    const auto at = std::ranges::find(scene.skull.points, dowel.base) - scene.skull.points.begin();
    ASSERT_EQ(field.status[at], DepthStatus::kAssigned);
    if (miss) {
      EXPECT_NEAR(field.depth_mm[at], dowel.depth_mm, *miss) << dowel.site;
    }
  }
}

TEST_P(EveryScheme, WorksWithTwoHundredDowels) {
  DowelScene scene = ScatteredScene(200);
  for (int k = 0; k < 66; ++k) {
    scene.network.areas.push_back({k, k + 67, k + 133});
  }
  const DepthField field = FieldOf(scene);
  EXPECT_GT(Count(field, DepthStatus::kAssigned), 100);
  for (std::size_t i = 0; i < field.status.size(); ++i) {
    EXPECT_EQ(std::isfinite(field.depth_mm[i]), field.status[i] == DepthStatus::kAssigned);
  }
}

// More dowels than vertices, several in each triangle.
TEST_P(EveryScheme, WorksWithAThousandDowels) {
  constexpr int kDowels = 1000;
  DowelScene scene;
  scene.skull = testing::SphereMesh({0, 0, 0}, 90, 11);
  scene.normals = VertexNormals(scene.skull);
  Random random(3);
  for (int k = 0; k < kDowels; ++k) {
    const Triangle& t = scene.skull.triangles[scene.skull.triangles.size() * k / kDowels];
    const double a = random.Uniform(0, 0.5), b = random.Uniform(0, 0.5);
    const Vec3 base = a * scene.skull.points[t[0]] + b * scene.skull.points[t[1]] +
                      (1 - a - b) * scene.skull.points[t[2]];
    scene.dowels.push_back(
        {std::to_string(100000 + k), base, base.normalized(), 10 + base.z() / 20, kNaN});
  }
  for (int k = 0; k + 2 < kDowels; k += 3) {
    scene.network.areas.push_back({k, k + 1, k + 2});
  }
  const DepthField field = FieldOf(scene);
  EXPECT_GT(Count(field, DepthStatus::kAssigned), 25);
  const auto [least, most] =
      std::ranges::minmax(scene.dowels, {}, [](const Dowel& dowel) { return dowel.depth_mm; });
  for (std::size_t i = 0; i < field.status.size(); ++i) {
    ASSERT_EQ(std::isfinite(field.depth_mm[i]), field.status[i] == DepthStatus::kAssigned);
    if (field.status[i] == DepthStatus::kAssigned) {
      EXPECT_GE(field.depth_mm[i], least.depth_mm - 1);
      EXPECT_LE(field.depth_mm[i], most.depth_mm + 1);
    }
  }
}

TEST_P(EveryScheme, WorksOnAPartialSkull) {
  DowelScene scene = DomeScene();
  scene.dowels.erase(scene.dowels.begin());  // sg
  scene.network.areas = {{2, 1, 3}};
  std::vector<bool> keep;
  for (const Triangle& t : scene.skull.triangles) {
    keep.push_back(scene.skull.points[t[0]].x() > -10 && scene.skull.points[t[0]].z() < 50);
  }
  scene.skull = Submesh(scene.skull, keep);
  scene.normals = VertexNormals(scene.skull);
  const DepthField field = FieldOf(scene);
  EXPECT_GT(Count(field, DepthStatus::kAssigned), 10);
  for (std::size_t i = 0; i < field.status.size(); ++i) {
    EXPECT_EQ(std::isfinite(field.depth_mm[i]), field.status[i] == DepthStatus::kAssigned);
  }
}

TEST_P(EveryScheme, EqualDepthsGiveThatDepth) {
  DowelScene scene = DomeScene();
  for (Dowel& dowel : scene.dowels) {
    dowel.depth_mm = 6.25;
  }
  const DepthField field = FieldOf(scene);
  for (std::size_t i = 0; i < field.status.size(); ++i) {
    if (field.status[i] == DepthStatus::kAssigned) {
      ASSERT_NEAR(field.depth_mm[i], 6.25, 1e-12);
    }
  }
}

TEST_P(EveryScheme, WorksWithThreeDowels) {
  DowelScene scene = FlatScene();
  scene.dowels.pop_back();
  scene.network.areas = {{0, 1, 2}};
  const DepthField field = FieldOf(scene);
  EXPECT_GT(Count(field, DepthStatus::kAssigned), 50);
  for (std::size_t i = 0; i < field.status.size(); ++i) {
    EXPECT_EQ(std::isfinite(field.depth_mm[i]), field.status[i] == DepthStatus::kAssigned);
  }
}

TEST_P(EveryScheme, StopsOnRequest) {
  const DowelScene scene = FlatScene();
  std::stop_source stop;
  stop.request_stop();
  RunContext run;
  run.stop_token = stop.get_token();
  EXPECT_THROW(InterpolateDepth(GetParam(), scene.Input(), run), Cancelled);
}

TEST_P(EveryScheme, ReportsAFaultyDowel) {
  DowelScene scene = FlatScene();
  scene.dowels[1].base.x() = kNaN;
  EXPECT_EQ(ErrorOf(scene), "dowel 'g': base (nan, 5, 0) is not finite; place it on the skull");
  scene = FlatScene();
  scene.dowels[1].direction *= 2;
  EXPECT_EQ(ErrorOf(scene),
            "dowel 'g': direction has length 2; it must be 1 (a unit vector out of the bone); "
            "normalise it");
  scene = FlatScene();
  scene.dowels[1].direction = Dowel{}.direction;
  EXPECT_THAT(ErrorOf(scene), ::testing::StartsWith("dowel 'g': direction has length nan; "));
  for (const auto& [depth, word] : {std::pair(kNaN, "nan"), std::pair(0.0, "0"),
                                    std::pair(-3.5, "-3.5"), std::pair(1 / 0.0, "inf")}) {
    scene = FlatScene();
    scene.dowels[1].depth_mm = depth;
    EXPECT_EQ(ErrorOf(scene), fmt::format("dowel 'g': depth is {} mm; it must be finite and above "
                                          "0; set it or leave the dowel out",
                                          word));
  }
}

TEST_P(EveryScheme, ReportsOtherFaults) {
  DowelScene scene = FlatScene();
  scene.dowels.clear();
  EXPECT_EQ(ErrorOf(scene), "dowels: there are none, but a depth needs at least one; place dowels");
  scene = FlatScene();
  scene.normals.pop_back();
  EXPECT_EQ(ErrorOf(scene),
            "skull: 440 normals for 441 vertices; there must be one per vertex; compute them from "
            "this mesh");
  scene = FlatScene();
  scene.network.areas[1][2] = 4;
  EXPECT_EQ(ErrorOf(scene),
            "dowel network: area 1 names dowel 4, but there are 4 (0..3); build the network from "
            "these dowels");
  scene = FlatScene();
  scene.skull.points[7].y() = kNaN;
  EXPECT_EQ(ErrorOf(scene), "skull: vertex 7 or its normal is not finite; repair the mesh");
}

TEST(NearestDepth, IsTheNearestDowelsAndFirstByNameAmongEquals) {
  const DowelScene scene = FlatScene().At({{8, 8, 3}, {33, 9, 0}, {20, 0, 0}, {20, 5, 0}});
  const DepthField field = InterpolateDepth(Nearest{}, scene.Input(), RunContext{});
  EXPECT_THAT(field.depth_mm, ::testing::ElementsAre(4, 7, 7, 7));
  EXPECT_THAT(field.sd_mm, ::testing::ElementsAre(1, 2, 2, 2));
}

TEST(NearestDepth, NeedsNoNetworkButFacingBone) {
  DowelScene scene = DomeScene();
  scene.network.areas.clear();
  const DepthField field = InterpolateDepth(Nearest{}, scene.Input(), RunContext{});
  EXPECT_GT(Count(field, DepthStatus::kNotFacing), 0);
  EXPECT_EQ(Count(field, DepthStatus::kOutside), 0);
  const DepthField all =
      InterpolateDepth(Nearest{.max_angle_deg = 180}, scene.Input(), RunContext{});
  EXPECT_EQ(Count(all, DepthStatus::kNotFacing), 0);
}

TEST(MeanDepth, IsTheMeanEverywhere) {
  const DepthField field = InterpolateDepth(Mean{}, FlatScene().Input(), RunContext{});
  EXPECT_THAT(field.depth_mm, ::testing::Each(6.25));
  EXPECT_EQ(Count(field, DepthStatus::kAssigned), 441);
  EXPECT_TRUE(std::isnan(field.sd_mm[0]));
}

}  // namespace
}  // namespace semblance::interp
