// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/skin_depths.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

RunContext Threads(int threads) {
  RunContext context;
  context.threads = threads;
  return context;
}

Experiment OnSkin() {
  Experiment experiment;
  experiment.subject = PhantomOptions{.random_seed = 5, .rings = 40};
  experiment.network =
      std::filesystem::path(SEMBLANCE_SOURCE_DIR) / "configs/networks/standard32.yaml";
  experiment.tissue.depths = DepthSource::kSkin;
  return experiment;
}

SubjectData LoadPhantom(const Experiment& experiment) {
  return LoadSubject(experiment.subject, Threads(2));
}

// The distance along the ray to the triangle, or infinity, by Cramer's rule.
double Along(const Vec3& from, const Vec3& direction, const TriMesh& mesh, const Triangle& t) {
  const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
  Mat3 columns;
  columns << -direction, b - a, c - a;
  const Vec3 solved = columns.inverse() * (from - a);
  const bool is_inside = solved.y() >= 0 && solved.z() >= 0 && solved.y() + solved.z() <= 1;
  return is_inside && solved.x() > 0 ? solved.x() : std::numeric_limits<double>::infinity();
}

TEST(MeasureOnSkin, FindsWhatARayThroughAllTrianglesFinds) {
  const Experiment experiment = OnSkin();
  SubjectData subject = LoadPhantom(experiment);
  const MeshQuery skull(subject.skull);
  const std::vector<Dowel> dowels =
      PlaceDowels(subject.landmarks, subject.skull, skull, experiment.landmarks);
  EXPECT_THAT(MeasureOnSkin(experiment, skull, Threads(2), subject), IsEmpty());
  for (std::size_t k = 0; k < dowels.size(); ++k) {
    double first = std::numeric_limits<double>::infinity();
    for (const Triangle& t : subject.skin->triangles) {
      first = std::min(first, Along(dowels[k].base, dowels[k].direction, *subject.skin, t));
    }
    const Landmark& landmark = subject.landmarks.landmarks[k];
    EXPECT_NEAR(landmark.depth_along_normal_mm.value(), first, 1e-6) << landmark.site;
  }
}

TEST(MeasureOnSkin, IgnoresTheDepthsOfTheLandmarkFile) {
  const Experiment experiment = OnSkin();
  SubjectData subject = LoadPhantom(experiment);
  const Case right = MakeCase(subject, experiment, Threads(2));
  for (Landmark& landmark : subject.landmarks.landmarks) {
    landmark.depth_along_normal_mm = 1;
    landmark.depth_closest_mm.reset();
  }
  const Case again = MakeCase(subject, experiment, Threads(1));
  ASSERT_THAT(again.dowels_on_bone, SizeIs(right.dowels_on_bone.size()));
  for (std::size_t k = 0; k < right.dowels_on_bone.size(); ++k) {
    EXPECT_EQ(again.dowels_on_bone[k].depth_mm, right.dowels_on_bone[k].depth_mm);
  }
}

TEST(MeasureOnSkin, LeavesOutSitesWithoutSkinInFront) {
  const Experiment experiment = OnSkin();
  SubjectData subject = LoadPhantom(experiment);
  const auto nasion = std::ranges::find(subject.landmarks.landmarks, "n", &Landmark::site);
  const Vec3 hole = nasion->Position();
  std::erase_if(subject.skin->triangles,
                [&](const Triangle& t) { return (subject.skin->points[t[0]] - hole).norm() < 40; });
  const Case made = MakeCase(subject, experiment, Threads(2));
  EXPECT_EQ(std::ranges::find(made.dowels_on_bone, "n", &Dowel::site), made.dowels_on_bone.end());
  EXPECT_THAT(made.notes,
              ::testing::Contains(HasSubstr("n (Nasion): no depth along the normal: no skin")));
  EXPECT_GT(made.dowels_on_bone.size(), 10u);
}

TEST(MeasureOnSkin, RefusesASubjectWithoutSkin) {
  const Experiment experiment = OnSkin();
  SubjectData subject = LoadPhantom(experiment);
  subject.skin.reset();
  try {
    MakeCase(subject, experiment, Threads(2));
    FAIL() << "no error";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("no true skin to measure on; name one under subject.skin"));
  }
}

}  // namespace
}  // namespace semblance::problems
