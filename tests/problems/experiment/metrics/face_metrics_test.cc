// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/face_metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "surfaces/base/error.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using testing::Plate;
using testing::SphereMesh;

TriMesh Shifted(TriMesh mesh, const Vec3& by) {
  for (Vec3& p : mesh.points) {
    p += by;
  }
  return mesh;
}

// A network of one area over the plate [0,40]^2: its triangle is (10,10) (30,10) (10,30).
std::vector<Dowel> ThreeDowels() {
  const Vec3 up(0, 0, 1);
  return {{"g", {10, 10, -5}, up, 5}, {"mso_l", {30, 10, -5}, up, 5}, {"n", {10, 30, -5}, up, 5}};
}
const DowelNetwork kOneArea{{{0, 1, 2}}, {}};

TEST(FaceMetrics, ParallelPlatesAreTheirDistanceApartEverywhere) {
  const TriMesh truth = Plate(40, 20);
  const FaceMetrics m =
      CompareFaces(truth, WholeSurface(truth), Shifted(truth, {0, 0, 2}), RunContext{});
  EXPECT_NEAR(m.truth_to_face.area_cm2, 16, 1e-9);
  for (const double d : {m.truth_to_face.mean_signed_mm, m.truth_to_face.mean_abs_mm,
                         m.truth_to_face.rms_mm, m.truth_to_face.median_mm, m.truth_to_face.p95_mm,
                         m.hausdorff_mm, m.face_to_truth.mean_signed_mm}) {
    EXPECT_NEAR(d, 2, 1e-9);
  }
  EXPECT_NEAR(m.truth_to_face.sd_mm, 0, 1e-6);
  EXPECT_EQ(m.truth_to_face.within_2_5mm, 1);
  EXPECT_NEAR(m.volume_between_cm3, 3.2, 1e-9);  // 40 x 40 x 2 mm^3
}

TEST(FaceMetrics, AFaceInsideTheTruthIsNegativeInBothDirections) {
  const TriMesh truth = SphereMesh({0, 0, 0}, 50, 40);
  const FaceMetrics m =
      CompareFaces(truth, WholeSurface(truth), SphereMesh({0, 0, 0}, 47, 40), RunContext{});
  EXPECT_NEAR(m.truth_to_face.mean_signed_mm, -3, 0.1);
  EXPECT_NEAR(m.face_to_truth.mean_signed_mm, -3, 0.1);
  EXPECT_EQ(m.truth_to_face.within_2_5mm, 0);
  EXPECT_NEAR(m.truth_to_face.within_5mm, 1, 1e-9);
}

TEST(FaceMetrics, QuantilesAreWeightedByArea) {
  // A plane tilted along x: the distance grows linearly, so its median is half its maximum whatever
  // the mesh's density.
  TriMesh truth = Plate(40, 40);
  for (Vec3& p : truth.points) {
    p.x() = p.x() * p.x() / 40;  // crowds the columns towards x = 0
  }
  TriMesh face = truth;
  for (Vec3& p : face.points) {
    p.z() = 0.01 * p.x();
  }
  const FaceMetrics m = CompareFaces(truth, WholeSurface(truth), face, RunContext{});
  EXPECT_NEAR(m.truth_to_face.median_mm, 0.2, 0.012);
  EXPECT_NEAR(m.truth_to_face.p95_mm, 0.38, 0.012);
}

TEST(FaceMetrics, ThreadsChangeNoBit) {
  const TriMesh truth = SphereMesh({0, 0, 0}, 50, 30), face = SphereMesh({1, 2, 0}, 49, 25);
  RunContext two;
  two.threads = 2;
  const FaceMetrics a = CompareFaces(truth, WholeSurface(truth), face, RunContext{});
  const FaceMetrics b = CompareFaces(truth, WholeSurface(truth), face, two);
  EXPECT_EQ(a.truth_to_face.rms_mm, b.truth_to_face.rms_mm);
  EXPECT_EQ(a.face_to_truth.mean_signed_mm, b.face_to_truth.mean_signed_mm);
  EXPECT_EQ(a.signed_mm, b.signed_mm);
}

TEST(FaceRegion, IsTheSkinOverTheNetwork) {
  const TriMesh skin = Plate(40, 80);
  const std::vector<Dowel> dowels = ThreeDowels();
  const FaceRegion region = InFrontOfNetwork(skin, dowels, kOneArea, {}, {});
  for (std::size_t v = 0; v < skin.points.size(); ++v) {
    const double x = skin.points[v].x(), y = skin.points[v].y();
    const double inside = std::min({x - 10, y - 10, (40 - x - y) / std::sqrt(2)});
    if (std::abs(inside) > 1e-6) {
      EXPECT_EQ(region.scored[v], inside > 0) << x << " " << y;
    }
  }
}

TEST(FaceRegion, MarginReachesAcrossTheBorderAndZonesAreLeftOut) {
  const TriMesh skin = Plate(40, 80);
  const std::vector<Dowel> dowels = ThreeDowels();
  const FaceRegion region =
      InFrontOfNetwork(skin, dowels, kOneArea, {}, {.margin_mm = 4, .exclude = {{"g", 8}}});
  for (std::size_t v = 0; v < skin.points.size(); ++v) {
    const Vec3& p = skin.points[v];
    if ((p - dowels[0].base).norm() < 7.9) {
      EXPECT_FALSE(region.scored[v]);
    }
    if (p.y() < 9.9 && p.y() > 6.1 && p.x() > 20 && p.x() < 28) {
      EXPECT_TRUE(region.scored[v]);
    }
    EXPECT_TRUE(!region.scored[v] || p.y() > 5.9);
    EXPECT_EQ(region.part[v] >= 0, bool(region.scored[v]));
  }
}

TEST(FaceRegion, PartsFollowTheNearestSite) {
  EXPECT_STREQ(kFaceParts[FacePartOfSite("go_l")], "jaw");
  EXPECT_STREQ(kFaceParts[FacePartOfSite("sg")], "forehead");
  EXPECT_STREQ(kFaceParts[FacePartOfSite("iM2_r")], "jaw");
  EXPECT_THROW(FacePartOfSite("elbow"), InputError);
}

TEST(FaceRegion, RefusesAnEmptyNetworkAndAnUnknownZone) {
  const TriMesh skin = Plate(40, 4);
  const std::vector<Dowel> dowels = ThreeDowels();
  EXPECT_THROW(InFrontOfNetwork(skin, dowels, DowelNetwork{}, {}, {}), InputError);
  EXPECT_THROW(InFrontOfNetwork(skin, dowels, kOneArea, {}, {.exclude = {{"zy_r", 8}}}),
               InputError);
}

TEST(FaceMetrics, NothingScoredIsAnError) {
  const TriMesh truth = Plate(40, 4);
  const FaceRegion none{std::vector<bool>(truth.points.size(), false),
                        std::vector<int>(truth.points.size(), -1)};
  EXPECT_THROW(CompareFaces(truth, none, truth, RunContext{}), InputError);
}

TEST(CompareFaces, WhereTheScanEndsTheFaceMayGoOn) {
  const TriMesh truth = testing::Plate(100, 20);
  TriMesh face = testing::Plate(300, 60);  // goes on for 100 mm on all sides
  for (Vec3& p : face.points) {
    p += Vec3(-100, -100, 2);
  }
  const FaceMetrics metrics = CompareFaces(truth, WholeSurface(truth), face, {});
  EXPECT_NEAR(metrics.face_to_truth.max_mm, 2, 1e-9);
  EXPECT_NEAR(metrics.hausdorff_mm, 2, 1e-9);
}

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
    // The mean distance times the area is 10 to 20 % off at 10 mm.
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
}  // namespace semblance::problems
