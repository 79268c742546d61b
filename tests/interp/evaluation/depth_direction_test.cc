// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/evaluation/depth_direction.h"

#include <gtest/gtest.h>

#include "surfaces/base/random.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::DomeScene;
using testing::DowelScene;
using testing::FlatScene;
using testing::Moved;
using testing::OnThreads;

std::vector<Vec3> Directions(const DepthDirection& direction, const DowelScene& scene,
                             int threads = 1) {
  return DepthDirections(direction, scene.Input(), OnThreads(threads));
}

const std::vector<DepthDirection> kAll = {MeshNormal{}, SmoothedNormal{.radius_mm = 12},
                                          DowelDirection{}};

TEST(DepthDirections, AreUnitMoveWithTheSkullAndDoNotDependOnThreads) {
  const DowelScene scene = DomeScene();
  const Mat3 rotation =
      Eigen::AngleAxisd(0.7, Vec3(0.4, -0.3, 0.85).normalized()).toRotationMatrix();
  const DowelScene moved = Moved(scene, {.rotation = rotation, .translation = Vec3(300, -120, 45)});
  for (const DepthDirection& each : kAll) {
    const std::vector<Vec3> here = Directions(each, scene), there = Directions(each, moved);
    EXPECT_TRUE(testing::SameBytes(here, Directions(each, scene, 2)));
    ASSERT_EQ(here.size(), scene.skull.points.size());
    for (std::size_t v = 0; v < here.size(); ++v) {
      ASSERT_NEAR(here[v].norm(), 1, 1e-12);
      ASSERT_NEAR((rotation * here[v] - there[v]).norm(), 0, 1e-6);
    }
  }
}

TEST(DepthDirections, OfTheMeshAreItsNormals) {
  const DowelScene scene = DomeScene();
  EXPECT_TRUE(testing::SameBytes(Directions(MeshNormal{}, scene), scene.normals));
}

// Compared with all pairs; the wall's inner side is 1 mm under the outer one.
TEST(DepthDirections, SmoothedOnesAreTheMeanWithinTheRadiusOfOneSide) {
  DowelScene scene = FlatScene();
  Random random(4);
  for (Vec3& p : scene.skull.points) {
    p.z() = random.Uniform(-1, 1);
  }
  const int count = static_cast<int>(scene.skull.points.size());
  for (int v = 0; v < count; ++v) {
    scene.skull.points.push_back(scene.skull.points[v] - Vec3(0, 0, 1));
  }
  for (std::size_t t = 0, end = scene.skull.triangles.size(); t < end; ++t) {
    const auto [a, b, c] = scene.skull.triangles[t];
    scene.skull.triangles.push_back({a + count, c + count, b + count});
  }
  scene.normals = VertexNormals(scene.skull);
  const std::vector<double> areas = VertexAreas(scene.skull);
  const std::vector<Vec3> smooth = Directions(SmoothedNormal{.radius_mm = 5}, scene);
  for (std::size_t v = 0; v < smooth.size(); ++v) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t w = 0; w < smooth.size(); ++w) {
      const bool near = (scene.skull.points[w] - scene.skull.points[v]).norm() <= 5;
      sum += near && scene.normals[w].dot(scene.normals[v]) > 0 ? areas[w] * scene.normals[w]
                                                                : Vec3(Vec3::Zero());
    }
    ASSERT_NEAR((smooth[v] - sum.normalized()).norm(), 0, 1e-12);
  }
  const auto tilt = [&](const std::vector<Vec3>& directions) {
    double sum = 0;
    for (int v = 0; v < count; ++v) {
      sum += 1 - directions[v].z();
    }
    return sum / count;
  };
  EXPECT_LT(tilt(smooth), 0.2 * tilt(scene.normals));
}

TEST(DepthDirections, OfDowelsAreTheirsAtBasesTheirMeanBetweenAndTheMeshsOutside) {
  DowelScene scene = FlatScene();
  scene.dowels[0].direction = Vec3(0.3, 0, 1).normalized();
  scene.dowels[2].direction = Vec3(0, -0.2, 1).normalized();
  const Vec3 half = scene.dowels[0].base + 0.5 * (scene.dowels[2].base - scene.dowels[0].base);
  const std::vector<Vec3> at = Directions(
      DowelDirection{}, scene.At({scene.dowels[0].base, half, {0, 50, 0}}, Vec3(0, 0.6, 0.8)));
  EXPECT_NEAR((at[0] - scene.dowels[0].direction).norm(), 0, 1e-9);
  EXPECT_NEAR((at[1] - (scene.dowels[0].direction + scene.dowels[2].direction).normalized()).norm(),
              0, 1e-9);
  EXPECT_EQ(at[2], Vec3(0, 0.6, 0.8));
}

}  // namespace
}  // namespace semblance::interp
