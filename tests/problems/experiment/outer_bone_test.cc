// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/outer_bone.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::semblance::testing::SphereMesh;

// A braincase: two spheres, the inner one facing inwards.
TriMesh HollowSphere(double outer_mm, double inner_mm) {
  TriMesh skull = SphereMesh({0, 0, 0}, outer_mm, 60);
  const TriMesh inner = SphereMesh({0, 0, 0}, inner_mm, 60);
  const auto first = static_cast<std::int32_t>(skull.points.size());
  skull.points.insert(skull.points.end(), inner.points.begin(), inner.points.end());
  for (const Triangle& t : inner.triangles) {
    skull.triangles.push_back({first + t[0], first + t[2], first + t[1]});
  }
  return skull;
}

std::vector<BoneSample> SampleOf(const TriMesh& skull, double area_mm2,
                                 const std::vector<BoneOrigin>& origin = {}) {
  const TriMesh shell = SphereMesh({0, 0, 0}, 50, 60);
  return SampleOuterBone(skull, origin, shell, MeshQuery(shell), area_mm2, {});
}

// A ball as a face, with (u,v) that are its coordinates x and y.
Tessellation BallFace(const Vec3& center, double radius_mm) {
  Tessellation face{.mesh = SphereMesh(center, radius_mm, 120), .uv = {}, .normals = {}};
  for (const Vec3& p : face.mesh.points) {
    face.uv.emplace_back(p.x(), p.y());
    face.normals.push_back((p - center).normalized());
  }
  return face;
}

TEST(OuterBone, SamplesStandForTheAreaOfTheOuterSheetAlone) {
  for (const double inner_mm : {46.0, 48.0}) {  // the second lies near the shell too
    const std::vector<BoneSample> samples = SampleOf(HollowSphere(50, inner_mm), 4);
    EXPECT_NEAR(4 * static_cast<double>(samples.size()), 4 * std::numbers::pi * 2500, 300);
    for (const BoneSample& sample : samples) {
      EXPECT_NEAR(sample.position.norm(), 50, 0.2);
      EXPECT_TRUE(std::isnan(sample.outside_mm));
    }
  }
}

TEST(OuterBone, BoneThatWasNotObservedHasNoSample) {
  const TriMesh skull = HollowSphere(50, 46);
  std::vector<BoneOrigin> origin(skull.triangles.size(), BoneOrigin::kObserved);
  for (std::size_t t = 0; t < origin.size(); ++t) {
    if (TriangleCentroid(skull, skull.triangles[t]).x() < 0) {
      origin[t] = BoneOrigin::kMirrored;
    }
  }
  const std::vector<BoneSample> samples = SampleOf(skull, 4, origin);
  EXPECT_NEAR(4 * static_cast<double>(samples.size()), 2 * std::numbers::pi * 2500, 150);
  for (const BoneSample& sample : samples) {
    EXPECT_GE(sample.position.x(), 0);
  }
}

TEST(OuterBone, OutsideIsTheDistanceFromTheFace) {
  std::vector<BoneSample> samples = SampleOf(HollowSphere(50, 46), 40);
  ASSERT_GT(samples.size(), 500u);
  const Vec3 center(4, 0, 0);
  MeasureOutside(BallFace(center, 52), samples, {});
  for (const BoneSample& sample : samples) {
    const Vec3 way = sample.position - center;
    EXPECT_NEAR(sample.outside_mm, way.norm() - 52, 0.1);
    const Vec3 foot = center + 52 * way.normalized();
    EXPECT_NEAR((sample.face_uv - Vec2(foot.x(), foot.y())).norm(), 0, 0.2);
  }
}

TEST(OuterBone, BoneBeyondTheBorderOfTheFaceIsNotMeasured) {
  Tessellation half = BallFace({0, 0, 0}, 52);
  std::erase_if(half.mesh.triangles,
                [&](const Triangle& t) { return TriangleCentroid(half.mesh, t).x() < 0; });
  std::vector<BoneSample> samples = SampleOf(HollowSphere(50, 46), 40);
  MeasureOutside(half, samples, {});
  ASSERT_GT(samples.size(), 500u);
  for (const BoneSample& sample : samples) {
    if (std::abs(sample.position.x()) > 5) {
      EXPECT_EQ(std::isnan(sample.outside_mm), sample.position.x() < 0) << sample.position;
    }
  }
}

}  // namespace
}  // namespace semblance::problems
