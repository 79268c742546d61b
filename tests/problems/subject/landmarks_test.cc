// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/landmarks.h"
#include "problems/landmark_files/read_landmarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "problems/subject/averaged_normal.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/shapes.h"

namespace semblance {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::Plate;
using testing::ScratchFile;
using testing::SphereMesh;
using testing::WordsOf;

constexpr char kGood[] = R"(subject: somebody
landmarks:
  - {site: g, point: [1, 2, 3], normal: [0, -0.8, 0.6], depth_along_normal_mm: 5.5, certainty: high}
  - {site: go_l, point: [60, 70, -80], depth_along_normal_mm: null, note: worn}
absent:
  - {site: iM2_r, reason: no mandible}
)";

std::string Complaints(const std::string& text) {
  return WordsOf<ConfigError>([&] { ReadLandmarks(ScratchFile(text)); });
}

LandmarkFile OneAt(const std::array<double, 3>& point) {
  LandmarkFile file;
  file.subject = "S1";
  file.landmarks.emplace_back();
  file.landmarks[0].site = "go_l";
  file.landmarks[0].point = point;
  return file;
}

double DegreesBetween(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

TEST(LandmarkFile, ReadsWhatIsWritten) {
  const LandmarkFile file = ReadLandmarks(ScratchFile(kGood)).file;
  EXPECT_EQ(file.subject, "somebody");
  ASSERT_EQ(file.landmarks.size(), 2u);
  EXPECT_EQ(file.landmarks[0].site, "g");
  EXPECT_EQ(file.landmarks[0].point, (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(file.landmarks[0].normal, (std::array<double, 3>{0, -0.8, 0.6}));
  EXPECT_EQ(file.landmarks[0].depth_along_normal_mm, 5.5);
  EXPECT_EQ(file.landmarks[0].certainty, Certainty::kHigh);
  EXPECT_FALSE(file.landmarks[1].normal.has_value());
  EXPECT_FALSE(file.landmarks[1].depth_along_normal_mm.has_value());
  EXPECT_EQ(file.landmarks[1].note, "worn");
  ASSERT_EQ(file.absent.size(), 1u);
  EXPECT_EQ(file.absent[0].reason, "no mandible");
}

TEST(LandmarkFile, RefusesUnknownUnitsAndAxes) {
  EXPECT_THAT(Complaints(std::string(kGood) + "units: feet\naxes: LAS\n"),
              AllOf(HasSubstr("units:"), HasSubstr("mm"), HasSubstr("axes:"), HasSubstr("RAS")));
}

TEST(LandmarkFile, ComesInMillimetresAndLps) {
  const LandmarkFile file =
      ReadLandmarks(
          ScratchFile("units: m\naxes: RAS\n"
                      "landmarks: [{site: g, point: [0.25, -0.5, 1], normal: [0.6, -0.8, 0], "
                      "depth_along_normal_mm: 5}]\n"))
          .file;
  const Landmark& g = file.landmarks.at(0);
  EXPECT_THAT(g.point, ElementsAre(-250, 500, 1000));
  EXPECT_THAT(*g.normal, ElementsAre(-0.6, 0.8, 0));
  EXPECT_EQ(g.depth_along_normal_mm, 5);
}

TEST(LandmarkFile, RefusesUnknownSites) {
  EXPECT_THAT(Complaints("landmarks: [{site: go_L, point: [1, 2, 3]}]\n"),
              HasSubstr("landmarks[0].site: unknown site 'go_L'; did you mean 'go_l'?"));
  EXPECT_THAT(Complaints("landmarks: [{site: go, point: [1, 2, 3]}]\n"),
              HasSubstr("site 'go' stands on both sides; write 'go_l' or 'go_r'"));
  EXPECT_THAT(Complaints("landmarks: [{site: g, point: [1, 2, 3]}]\nabsent: [{site: rhii}]\n"),
              HasSubstr("absent[0].site: unknown site 'rhii'; did you mean 'rhi'?"));
}

TEST(LandmarkFile, RefusesRepeatedSites) {
  EXPECT_THAT(Complaints("landmarks: [{site: g, point: [1, 2, 3]}, {site: g, point: [1, 2, 4]}]\n"),
              HasSubstr("landmarks: site 'g' appears twice; keep one"));
  EXPECT_THAT(Complaints("landmarks: [{site: g, point: [1, 2, 3]}]\nabsent: [{site: g}]\n"),
              HasSubstr("absent: site 'g' already stands in this file; keep one"));
}

TEST(LandmarkFile, RefusesNothingNoPointAndNoUnitNormal) {
  EXPECT_THAT(Complaints("subject: x\n"), HasSubstr("landmarks: there is none; place at least"));
  EXPECT_THAT(Complaints("landmarks: [{site: g}]\n"), HasSubstr("point: is not given"));
  EXPECT_THAT(Complaints("landmarks: [{site: g, point: [1, 2, 3], normal: [0, 0, 2]}]\n"),
              HasSubstr("normal: has the length 2; it must be 1, or leave the normal out"));
  EXPECT_THAT(Complaints("landmarks: [{site: g, point: [1, 2, 3], depth_closest_mm: 0}]\n"),
              HasSubstr("depth_closest_mm"));
}

TEST(PlaceDowels, SnapsToTheSkullAndTakesTheGivenNormal) {
  LandmarkFile file = OneAt({10, 10, 2.5});
  file.landmarks[0].normal = {0, 0.6, 0.7999};
  const std::vector<Dowel> dowels = PlaceDowels(file, Plate(40, 8), {});
  ASSERT_EQ(dowels.size(), 1u);
  EXPECT_EQ(dowels[0].site, "go_l");
  EXPECT_NEAR((dowels[0].base - Vec3(10, 10, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR(dowels[0].direction.norm(), 1, 1e-15);
  EXPECT_NEAR(DegreesBetween(dowels[0].direction, Vec3(0, 0.6, 0.8)), 0, 0.01);
  EXPECT_TRUE(std::isnan(dowels[0].depth_mm));
  EXPECT_TRUE(std::isnan(dowels[0].sd_mm));
}

TEST(PlaceDowels, RefusesALandmarkOffTheSkull) {
  EXPECT_EQ(WordsOf<InputError>([] {
              PlaceDowels(OneAt({10, 10, 20}), Plate(40, 8), {});
            }),
            "landmarks of S1: site go_l (Gonion) is 20.0 mm from the skull, and at most 3 mm are "
            "allowed (max_distance_mm); correct its point, or check that landmarks and skull share "
            "one frame");
  EXPECT_NO_THROW(PlaceDowels(OneAt({10, 10, 20}), Plate(40, 8), {.max_distance_mm = 20.5}));
}

TEST(PlaceDowels, DirectionIsTheSkullsNormal) {
  const TriMesh ball = SphereMesh({5, 6, 7}, 50, 60);
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const Vec3 out = random.InBox(-1, 1).normalized();
    const Vec3 at = Vec3(5, 6, 7) + 50.5 * out;
    const Dowel dowel = PlaceDowels(OneAt({at.x(), at.y(), at.z()}), ball, {}).at(0);
    EXPECT_LT(DegreesBetween(dowel.direction, out), 1.5);  // a facet is 3 degrees wide
  }
}

// A roof along the line x = `ridge`, rising by `slope` on its left and falling on its right.
TriMesh Roof(double slope, int n) {
  TriMesh mesh = Plate(40, n);
  for (Vec3& p : mesh.points) {
    p.z() = -slope * std::abs(p.x() - 20);
  }
  return mesh;
}

TEST(AveragedNormal, IsWeightedByAreaNotByTriangles) {
  // Points crowd on the left of the ridge; both sides weigh the same all the same.
  TriMesh mesh = Plate(40, 80);
  for (Vec3& p : mesh.points) {
    p.x() = p.x() <= 20 ? 20 - 20 * std::pow(1 - p.x() / 20, 2.0) : p.x();
    p.z() = -0.5 * std::abs(p.x() - 20);
  }
  const Vec3 base(20.01, 20, -0.005);
  const Dowel dowel = PlaceDowels(OneAt({base.x(), base.y(), base.z()}), mesh, {}).at(0);
  EXPECT_LT(DegreesBetween(dowel.direction, Vec3(0, 0, 1)), 2);
}

TEST(AveragedNormal, IsTheSameOnACoarseMeshAndOnAFineOne) {
  const Vec3 base(21, 20, -0.5);
  const Sphere ball{base, 3};
  const auto nearest = [&](const TriMesh& mesh) {
    int best = 0;
    for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
      const auto distance = [&](int i) {
        return (TriangleCentroid(mesh, mesh.triangles[i]) - base).norm();
      };
      best = distance(t) < distance(best) ? t : best;
    }
    return best;
  };
  const TriMesh coarse = Roof(0.5, 2), fine = Roof(0.5, 100);
  const Vec3 a = AveragedNormal(coarse, nearest(coarse), ball);
  const Vec3 b = AveragedNormal(fine, nearest(fine), ball);
  EXPECT_LT(DegreesBetween(a, b), 1);
  EXPECT_GT(DegreesBetween(b, Vec3(0, 0, 1)), 5);  // more of the right side is within reach
}

TEST(AveragedNormal, TheInnerSideOfAThinWallHasNoSay) {
  TriMesh wall = Plate(40, 40);
  const int count = static_cast<int>(wall.points.size());
  const TriMesh front = wall;
  for (const Vec3& p : front.points) {
    wall.points.push_back(p - Vec3(0, 0, 0.5 + 0.01 * p.x()));
  }
  for (const Triangle& t : front.triangles) {
    wall.triangles.push_back({t[0] + count, t[2] + count, t[1] + count});
  }
  const Dowel dowel = PlaceDowels(OneAt({20, 20, 0.1}), wall, {}).at(0);
  EXPECT_LT(DegreesBetween(dowel.direction, Vec3(0, 0, 1)), 1e-6);
}

TEST(AveragedNormal, TheBackOfAThinWallHasNoSayNearItsRim) {
  TriMesh disc = SphereMesh({0, 0, 0}, 50, 200);  // front and back are connected over the rim
  for (Vec3& p : disc.points) {
    p.z() *= 0.01;
  }
  const Dowel dowel = PlaceDowels(OneAt({48.5, 0, 0.2}), disc, {}).at(0);
  EXPECT_LT(DegreesBetween(dowel.direction, Vec3(0, 0, 1)), 5);
}

TEST(PlaceDowels, RefusesToGuessADirection) {
  TriMesh line;
  line.points = {{0, 0, 0}, {10, 0, 0}, {5, 0, 0}};
  line.triangles = {{0, 1, 2}};
  EXPECT_THAT(WordsOf<InputError>([&] {
                PlaceDowels(OneAt({5, 0, 0}), line, {});
              }),
              HasSubstr("give the landmark a normal, or increase normal_radius_mm"));
}

}  // namespace
}  // namespace semblance
