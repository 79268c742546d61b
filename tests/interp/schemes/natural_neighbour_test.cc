// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/natural_neighbour.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "interp/schemes/power_cell.h"
#include "surfaces/base/random.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::DowelScene;
using testing::FlatScene;
using testing::ScatteredScene;

class NaturalNeighbours : public ::testing::TestWithParam<NeighbourWeights> {
 protected:
  DepthField FieldAt(const DowelScene& scene, std::vector<Vec3> points) const {
    DowelScene at = scene.At(std::move(points));
    at.network.areas.clear();
    return InterpolateDepth(NaturalNeighbour{.weights = GetParam()}, at.Input(), RunContext{});
  }
};
INSTANTIATE_TEST_SUITE_P(Both, NaturalNeighbours,
                         ::testing::Values(NeighbourWeights::kSibson, NeighbourWeights::kLaplace),
                         [](const auto& each) {
                           return std::string(EnumNames(each.param)[static_cast<int>(each.param)]);
                         });

DowelScene PlaneScene(int count) {
  Random random(5);
  DowelScene scene = FlatScene();
  for (int k = 0; k < count; ++k) {
    scene.dowels.push_back({std::to_string(100 + k),
                            {random.Uniform(5, 35), random.Uniform(5, 35), 0},
                            {0, 0, 1},
                            1,
                            1});
  }
  return scene;
}

TEST_P(NaturalNeighbours, ReproduceALinearDepthOnAPlane) {
  DowelScene scene = PlaneScene(20);
  const auto depth = [](const Vec3& p) { return 5 + 0.1 * p.x() + 0.05 * p.y(); };
  for (Dowel& dowel : scene.dowels) {
    dowel.depth_mm = depth(dowel.base);
    dowel.sd_mm = depth(dowel.base) / 4;
  }
  Random random(8);
  for (int k = 0; k < 200; ++k) {
    const Vec3 p(random.Uniform(6, 34), random.Uniform(6, 34), 0);
    const DepthField field = FieldAt(scene, {p});
    ASSERT_EQ(field.status[0], DepthStatus::kAssigned);
    ASSERT_NEAR(field.depth_mm[0], depth(p), 1e-9);
    ASSERT_NEAR(field.sd_mm[0], depth(p) / 4, 1e-9);
  }
}

TEST_P(NaturalNeighbours, InTheMiddleOfASquareAreItsFourCorners) {
  EXPECT_NEAR(FieldAt(FlatScene(), {{20, 20, 0}}).depth_mm[0], 6.25, 1e-9);
}

TEST_P(NaturalNeighbours, GiveNothingOutsideTheHullAndTheDowelAtADowel) {
  const DepthField field = FieldAt(FlatScene(), {{2, 20, 0}, {50, 50, 0}, {5, 5, 0}, {35, 35, 0}});
  EXPECT_THAT(field.status, ::testing::ElementsAre(DepthStatus::kOutside, DepthStatus::kOutside,
                                                   DepthStatus::kAssigned, DepthStatus::kAssigned));
  EXPECT_EQ(field.depth_mm[2], 4);
  EXPECT_EQ(field.depth_mm[3], 9);
}

TEST_P(NaturalNeighbours, AreContinuousOnACurvedBone) {
  const DowelScene scene = ScatteredScene(60);
  std::vector<Vec3> path, normals;
  for (int k = 0; k <= 4000; ++k) {
    const double turn = -0.6 + 1.2 * k / 4000;
    normals.push_back(Vec3(std::sin(turn), -std::cos(turn), 0.3 * std::sin(2 * turn)).normalized());
    path.push_back(90 * normals.back());
  }
  DowelScene at = scene.At(path);
  at.normals = normals;
  const DepthField field =
      InterpolateDepth(NaturalNeighbour{.weights = GetParam()}, at.Input(), RunContext{});
  for (std::size_t k = 1; k < path.size(); ++k) {
    ASSERT_EQ(field.status[k], DepthStatus::kAssigned);
    ASSERT_NEAR(field.depth_mm[k], field.depth_mm[k - 1], 0.05);
  }
}

// Sibson's depth from all dowels by clipping each dowel's part: quadratic time, but complete.
double DepthFromAll(const std::vector<Dowel>& dowels, const Vec3& p, const Vec3& normal) {
  const Vec3 first = normal.unitOrthogonal(), second = normal.cross(first);
  std::vector<PowerSite> sites;
  PowerCell cell(1000);
  for (const Dowel& dowel : dowels) {
    const Vec3 x = dowel.base - p;
    sites.push_back({{x.dot(first), x.dot(second)}, x.squaredNorm()});
    cell.Cut(sites.back(), static_cast<int>(sites.size()) - 1);
  }
  SiteAreas areas;
  SibsonAreasByClipping(sites, cell.polygon(), areas);
  double sum = 0, depth = 0;
  for (std::size_t k = 0; k < areas.size(); ++k) {
    sum += areas[k];
    depth += areas[k] * dowels[k].depth_mm;
  }
  return depth / sum;
}

TEST(NaturalNeighbour, LeavesOutNoDowelThatHasAPart) {
  Random random(3);
  std::vector<Vec3> points, normals;
  for (int k = 0; k < 100; ++k) {
    normals.push_back(Vec3(random.Uniform(-0.5, 0.5), -1, random.Uniform(-0.5, 0.5)).normalized());
    points.push_back(90 * normals.back());
  }
  for (const int count : {20, 60, 300}) {  // 300 dowels, of which only the nearest of each are
                                           // sorted
    DowelScene scene = ScatteredScene(count).At(points);
    scene.normals = normals;
    const DepthField field = InterpolateDepth(NaturalNeighbour{}, scene.Input(), RunContext{});
    EXPECT_GT(testing::Count(field, DepthStatus::kAssigned), 90) << count;
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (field.status[k] == DepthStatus::kAssigned) {
        ASSERT_NEAR(field.depth_mm[k], DepthFromAll(scene.dowels, points[k], normals[k]), 1e-9);
      }
    }
  }
}

TEST(NaturalNeighbour, SibsonsWeightsAreStolenAreas) {
  // Counted on a grid, for a vertex 5 mm right of the middle of the square.
  const DowelScene scene = FlatScene();
  const Vec3 p(25, 20, 0);
  std::array<double, 4> counts{};
  for (int i = 0; i < 1200; ++i) {
    for (int j = 0; j < 1200; ++j) {
      const Vec3 x(-20 + (i + 0.5) / 15, -20 + (j + 0.5) / 15, 0);
      std::array<double, 4> distance{};
      for (int k = 0; k < 4; ++k) {
        distance[k] = (x - scene.dowels[k].base).norm();
      }
      const auto nearest = std::ranges::min_element(distance) - distance.begin();
      counts[nearest] += (x - p).norm() < distance[nearest] ? 1 : 0;
    }
  }
  double sum = 0, depth = 0;
  for (int k = 0; k < 4; ++k) {
    sum += counts[k];
    depth += counts[k] * scene.dowels[k].depth_mm;
  }
  DowelScene at = scene.At({p});
  const DepthField field = InterpolateDepth(NaturalNeighbour{}, at.Input(), RunContext{});
  EXPECT_NEAR(field.depth_mm[0], depth / sum, 0.005);
}

}  // namespace
}  // namespace semblance::interp
