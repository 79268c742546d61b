// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/propose/suggestion_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;

TriMesh TurnedInside(TriMesh mesh) {
  for (Triangle& t : mesh.triangles) {
    std::swap(t[1], t[2]);
  }
  return mesh;
}

// A vault: an outer and an inner table 6 mm apart, cut open in front of y = 40.
class Vault : public ::testing::Test {
 protected:
  static TriMesh Make() {
    const TriMesh whole = testing::Joined(testing::SphereMesh(Vec3::Zero(), 80, 60),
                                          TurnedInside(testing::SphereMesh(Vec3::Zero(), 74, 60)));
    std::vector<bool> keep;
    for (const Triangle& t : whole.triangles) {
      keep.push_back(TriangleCentroid(whole, t).y() < 40);
    }
    return Submesh(whole, keep);
  }
  std::string Fault(const Vec3& direction, double radius_mm) const {
    return SuggestionFault(query_.Closest(radius_mm * direction).position, direction,
                           {mesh_, query_, ends_});
  }

  const TriMesh mesh_ = Make();
  const MeshQuery query_{mesh_};
  const SurfaceEnds ends_{mesh_};
};

TEST_F(Vault, TheOuterTableIsSuggestedAndTheInnerOneIsNot) {
  for (const Vec3& direction : {Vec3(0, -1, 0), Vec3(1, 0, 0), Vec3(-0.6, -0.8, 0)}) {
    EXPECT_EQ(Fault(direction, 80), "");
    EXPECT_THAT(Fault(direction, 74), HasSubstr("faces another way"));
  }
}

// From behind, the outer table of the front faces the right way, but lies under the near side.
TEST_F(Vault, BoneUnderBoneIsNotSuggested) {
  const TriMesh layers = testing::Joined(testing::SphereMesh(Vec3::Zero(), 80, 60),
                                         testing::SphereMesh(Vec3::Zero(), 70, 60));
  const MeshQuery query(layers);
  const SurfaceEnds ends(layers);
  const Vec3 front(0, -1, 0);
  EXPECT_THAT(SuggestionFault(70 * front, front, {layers, query, ends}),
              HasSubstr("under other bone"));
  EXPECT_EQ(SuggestionFault(80 * front, front, {layers, query, ends}), "");
}

TEST_F(Vault, AMarkerPointsHalfwayBetweenTheBonesDirectionAndTheSites) {
  const Vec3 bone(0, -1, 0), site = Vec3(0.6, -0.8, 0);
  const Vec3 found =
      SuggestedDirection(query_.Closest(80 * bone).position, site, {mesh_, query_, ends_});
  EXPECT_NEAR(found.norm(), 1, 1e-12);
  EXPECT_NEAR(found.dot(bone), found.dot(site), 0.01);
  EXPECT_NEAR(found.cross(bone).normalized().dot(site), 0, 0.05) << "in the plane of the two";
}

TEST_F(Vault, TheEndOfTheSurfaceIsNotSuggested) {
  const Vec3 at_the_cut = Vec3(std::sqrt(80.0 * 80 - 39 * 39), 39, 0) / 80;
  EXPECT_THAT(Fault(at_the_cut, 80), HasSubstr("the bone ends there"));
}

TEST_F(Vault, APredictionInsideOrOutsideIsLaidOnTheOuterTable) {
  const Vec3 front(0, -1, 0);
  for (const double radius_mm : {70.0, 77.0, 90.0}) {
    const auto found = FindOuterPoint(radius_mm * front, front, {mesh_, query_, ends_});
    ASSERT_TRUE(found) << radius_mm;
    EXPECT_NEAR(found->norm(), 80, 0.3) << radius_mm;
  }
  EXPECT_FALSE(FindOuterPoint(Vec3(0, 80, 0), Vec3(0, 1, 0), {mesh_, query_, ends_}));
}

}  // namespace
}  // namespace semblance::problems
