// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/metrics/enclosed_volume.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "problems/metrics/face_metrics.h"
#include "tests/testing/shapes.h"

namespace semblance {
namespace {

using testing::Plate;
using testing::SphereMesh;

double BallVolume_cm3(double radius_mm) {
  return 4.0 / 3 * std::numbers::pi * std::pow(radius_mm, 3) / 1000;
}

TEST(EnclosedVolume, OfConcentricSpheresIsTheShell) {
  const TriMesh truth = SphereMesh({0, 0, 0}, 50, 60);
  for (const double radius : {40.0, 53.0}) {
    const FaceMetrics m =
        CompareFaces(truth, WholeSurface(truth), SphereMesh({0, 0, 0}, radius, 60), RunContext{});
    const double shell = BallVolume_cm3(radius) - BallVolume_cm3(50);
    EXPECT_NEAR(m.volume.Net(), shell, 0.005 * std::abs(shell));
    EXPECT_NEAR(m.volume.Enclosed(), std::abs(shell), 0.005 * std::abs(shell));
    // What the mean distance times the area makes of it is 10 to 20 % off at 10 mm.
    EXPECT_GT(std::abs(m.volume_between_cm3 - std::abs(shell)), 0.03 * std::abs(shell));
  }
}

// The face is the truth's plate, turned about its middle line: two wedges of equal volume.
TEST(EnclosedVolume, IsDividedWhereTheSurfacesCross) {
  for (const int n : {5, 8}) {  // the middle line within and between triangles
    const TriMesh plate = Plate(40, n);
    std::vector<Vec3> move;
    std::vector<double> signed_mm;
    for (const Vec3& p : plate.points) {
      signed_mm.push_back(0.1 * (p.x() - 20));
      move.emplace_back(0, 0, signed_mm.back());
    }
    const std::vector<int> part(plate.points.size(), 3);
    const VolumeByPart volume = MeasureEnclosed(plate, move, signed_mm, part);
    const double wedge_cm3 = 0.5 * 20 * 2 * 40 / 1000;
    EXPECT_NEAR(volume.all.outside_cm3, wedge_cm3, 1e-12);
    EXPECT_NEAR(volume.all.inside_cm3, wedge_cm3, 1e-12);
    EXPECT_NEAR(volume.all.Net(), 0, 1e-12);
    EXPECT_NEAR(volume.parts.at(3).Enclosed(), volume.all.Enclosed(), 1e-12);
  }
}

TEST(EnclosedVolume, LeavesTrianglesOutThatAreNotScored) {
  const TriMesh plate = Plate(40, 4);
  std::vector<double> signed_mm(plate.points.size(), 2);
  std::vector<int> part(plate.points.size(), 0);
  const std::vector<Vec3> move(plate.points.size(), Vec3(0, 0, 2));
  EXPECT_NEAR(MeasureEnclosed(plate, move, signed_mm, part).all.outside_cm3, 3.2, 1e-12);
  signed_mm[0] = kNaN;  // a corner of the plate, of two triangles of 50 mm^2
  part[1] = 1;
  const VolumeByPart less = MeasureEnclosed(plate, move, signed_mm, part);
  EXPECT_NEAR(less.all.outside_cm3, 3.0, 1e-12);
  EXPECT_NEAR(less.parts.at(0).outside_cm3 + less.parts.at(1).outside_cm3, 3.0, 1e-12);
}

TEST(FaceMetrics, NormalsOfATurnedPlateAreItsAngleOff) {
  const TriMesh truth = Plate(40, 20);
  TriMesh face = Plate(100, 20);
  const double slope = std::tan(10 * std::numbers::pi / 180);
  for (Vec3& p : face.points) {
    p = Vec3(p.x() - 30, p.y() - 30, slope * (p.x() - 30));
  }
  const FaceMetrics m = CompareFaces(truth, WholeSurface(truth), face, RunContext{});
  EXPECT_NEAR(m.normals.mean_deg, 10, 1e-9);
  EXPECT_NEAR(m.normals.p95_deg, 10, 1e-9);
}

TEST(FaceMetrics, SymmetricIsTheMeanOfBothDirections) {
  const TriMesh truth = SphereMesh({0, 0, 0}, 50, 40), face = SphereMesh({3, 1, 0}, 48, 30);
  const FaceMetrics m = CompareFaces(truth, WholeSurface(truth), face, RunContext{});
  EXPECT_NEAR(m.symmetric.mean_abs_mm,
              (m.truth_to_face.mean_abs_mm + m.face_to_truth.mean_abs_mm) / 2, 1e-12);
  EXPECT_NEAR(std::pow(m.symmetric.rms_mm, 2),
              (std::pow(m.truth_to_face.rms_mm, 2) + std::pow(m.face_to_truth.rms_mm, 2)) / 2,
              1e-12);
  EXPECT_EQ(m.symmetric.max_mm, m.hausdorff_mm);
}

}  // namespace
}  // namespace semblance
