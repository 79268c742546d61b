// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/protocols.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "problems/subject/phantom.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using testing::Plate;

const Vec3 kUp(0, 0, 1);

TriMesh FaceOfHead() { return MakePhantom({.rings = 40}).face; }

Similarity Turned(double degrees, const Vec3& shift) {
  const Vec3 axis = Vec3(1, 2, 3).normalized();
  return {1, Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis).toRotationMatrix(), shift};
}

TEST(BestFit, FindsAKnownMotion) {
  const TriMesh truth = FaceOfHead();
  const Similarity moved = Turned(3, {2, -4, 1});
  const TriMesh face = Transformed(truth, moved);
  const BestFitScore score = ScoreBestFit(truth, WholeSurface(truth), face, {});
  EXPECT_TRUE(score.converged);
  EXPECT_LT(score.truth_to_face.rms_mm, 1e-3);
  EXPECT_NEAR(score.turned_deg, 3, 1e-3);
  for (const Vec3& p : {Vec3(0, 0, 0), Vec3(50, 50, -80)}) {
    EXPECT_LT((score.aligned_from_face * (moved * p) - p).norm(), 0.01);
  }
}

TEST(BestFit, IsNeverWorseThanTheFrameOfTheScan) {
  const TriMesh truth = FaceOfHead();
  TriMesh face = MakePhantom({.random_seed = 5, .rings = 40}).face;
  const FaceRegion region = WholeSurface(truth);
  const double in_frame = CompareFaces(truth, region, face, {}).truth_to_face.rms_mm;
  const BestFitScore score = ScoreBestFit(truth, region, face, {});
  EXPECT_LT(score.truth_to_face.rms_mm, in_frame);
  EXPECT_TRUE(score.converged);
  // At rest: a small motion any way is no better.
  for (const Vec3& shift : {Vec3(0.2, 0, 0), Vec3(0, -0.2, 0), Vec3(0, 0, 0.2)}) {
    Similarity pose = score.aligned_from_face;
    pose.translation += shift;
    EXPECT_GT(CompareFaces(truth, region, Transformed(face, pose), {}).truth_to_face.rms_mm,
              score.truth_to_face.rms_mm - 1e-3);
  }
}

TEST(BestFit, ThreadsChangeNoBit) {
  const TriMesh truth = FaceOfHead(), face = Transformed(truth, Turned(2, {1, 1, 1}));
  RunContext two;
  two.threads = 2;
  EXPECT_EQ(ScoreBestFit(truth, WholeSurface(truth), face, {}).truth_to_face.rms_mm,
            ScoreBestFit(truth, WholeSurface(truth), face, two).truth_to_face.rms_mm);
}

// A face parallel to a slope, 2 mm above it along the view: nearer than that at the closest point.
TEST(ViewRay, IsMeasuredAlongTheViewAndWeightedByThePicture) {
  TriMesh truth = Plate(40, 20), face = Plate(120, 20);
  for (Vec3& p : truth.points) {
    p.z() = 0.75 * p.x();
  }
  for (Vec3& p : face.points) {
    p += Vec3(-40, -40, 0);
    p.z() = 0.75 * p.x() + 2;
  }
  const FaceRegion region = WholeSurface(truth);
  const ViewRayScore score = ScoreAlongView(truth, region, face, kUp, {});
  EXPECT_NEAR(score.along_ray.mean_signed_mm, 2, 1e-9);
  EXPECT_NEAR(score.along_ray.area_cm2, 16, 1e-9);
  EXPECT_NEAR(score.missed_cm2, 0, 1e-12);
  EXPECT_NEAR(CompareFaces(truth, region, face, {}).truth_to_face.mean_abs_mm, 2 * 0.8, 1e-9);
}

TEST(ViewRay, LeavesOutWhatIsHiddenSteepOrBesideTheFace) {
  TriMesh truth = testing::Joined(Plate(40, 20), Plate(40, 20));
  const std::size_t half = truth.points.size() / 2;
  for (std::size_t v = half; v < truth.points.size(); ++v) {
    truth.points[v].z() = -10;  // under the first
  }
  TriMesh face = Plate(20, 10);  // over a quarter
  for (Vec3& p : face.points) {
    p.z() = 1;
  }
  const ViewRayScore score = ScoreAlongView(truth, WholeSurface(truth), face, kUp, {});
  EXPECT_NEAR(score.along_ray.area_cm2 + score.missed_cm2, 16, 1e-9);
  EXPECT_NEAR(score.along_ray.area_cm2, 4, 0.5);
  EXPECT_NEAR(score.along_ray.mean_abs_mm, 1, 1e-9);
  const Vec3 grazing = Vec3(1, 0, 0.1).normalized();
  EXPECT_TRUE(std::isnan(
      ScoreAlongView(truth, WholeSurface(truth), face, grazing, {}).along_ray.mean_abs_mm));
}

}  // namespace
}  // namespace semblance::problems
