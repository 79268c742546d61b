// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/dowel_placement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Plate;
using testing::SphereMesh;
using testing::WordsOf;

struct Cloud {
  std::vector<std::string> sites;
  std::vector<Vec3> points;
};

Cloud RandomCloud(int count, std::uint64_t random_seed) {
  Random random(random_seed);
  Cloud cloud;
  for (int k = 0; k < count; ++k) {
    cloud.sites.push_back(std::to_string(k));
    cloud.points.push_back(random.InBox(-50, 50));
  }
  return cloud;
}

std::vector<bool> Kept(const LandmarksKept& kept, const Cloud& cloud) {
  return KeptSites(kept, cloud.sites, cloud.points);
}

TEST(KeptLandmarks, KeepsTheNumberAndFewerAreAmongMore) {
  const Cloud cloud = RandomCloud(32, 1);
  for (int n = 3; n < 40; ++n) {
    for (const auto& [few, more] :
         {std::pair<LandmarksKept, LandmarksKept>{KeepSpread{n}, KeepSpread{n + 1}},
          std::pair<LandmarksKept, LandmarksKept>{KeepRandom{n, 7}, KeepRandom{n + 1, 7}}}) {
      const std::vector<bool> a = Kept(few, cloud), b = Kept(more, cloud);
      EXPECT_EQ(std::count(a.begin(), a.end(), true), std::min(n, 32));
      for (std::size_t k = 0; k < a.size(); ++k) {
        EXPECT_LE(a[k], b[k]);
      }
    }
  }
  EXPECT_NE(Kept(KeepRandom{10, 1}, cloud), Kept(KeepRandom{10, 2}, cloud));
}

// Gonzalez 1985: no choice of n points covers the rest within less than half the radius.
TEST(KeptLandmarks, SpreadCoversWithinTwiceTheBestRadius) {
  const Cloud cloud = RandomCloud(9, 3);
  const auto radius = [&](const std::vector<bool>& kept) {
    double worst = 0;
    for (const Vec3& p : cloud.points) {
      double nearest = std::numeric_limits<double>::infinity();
      for (std::size_t k = 0; k < kept.size(); ++k) {
        nearest = kept[k] ? std::min(nearest, (p - cloud.points[k]).norm()) : nearest;
      }
      worst = std::max(worst, nearest);
    }
    return worst;
  };
  double best = std::numeric_limits<double>::infinity();
  std::vector<bool> choice = {true, true, true, true, false, false, false, false, false};
  do {
    best = std::min(best, radius(choice));
  } while (std::prev_permutation(choice.begin(), choice.end()));
  EXPECT_LE(radius(Kept(KeepSpread{4}, cloud)), 2 * best);
}

// A ball of 80 mm with landmarks on it.
LandmarkFile OnBall(int count) {
  LandmarkFile file;
  Random random(5);
  for (int k = 0; k < count; ++k) {
    const Vec3 p = 80 * random.Direction();
    Landmark& landmark = file.landmarks.emplace_back();
    landmark.site = StandardSiteCodes()[k];
    landmark.point = {p.x(), p.y(), p.z()};
  }
  return file;
}

TEST(LandmarksInUse, AreAllUnchangedByDefault) {
  const TriMesh ball = SphereMesh({0, 0, 0}, 80, 60);
  const UsedLandmarks used = LandmarksInUse(OnBall(32), MeshQuery(ball), {});
  EXPECT_EQ(used.file.landmarks.size(), 32u);
  EXPECT_THAT(used.notes, IsEmpty());
}

TEST(LandmarksInUse, NoiseHasItsSizeLiesOnTheBoneAndDoesNotDependOnWhatIsKept) {
  const TriMesh ball = SphereMesh({0, 0, 0}, 80, 60);
  const MeshQuery query(ball);
  const LandmarkFile file = OnBall(32);
  const UsedLandmarks all = LandmarksInUse(file, query, {.noise_mm = 2, .random_seed = 4});
  const UsedLandmarks some =
      LandmarksInUse(file, query, {.keep = KeepSpread{8}, .noise_mm = 2, .random_seed = 4});
  double squares = 0;
  for (std::size_t k = 0; k < 32; ++k) {
    const auto& [x, y, z] = all.file.landmarks[k].point;
    const auto& [x0, y0, z0] = file.landmarks[k].point;
    const Vec3 p(x, y, z);
    EXPECT_LT(query.Closest(p).distance_mm, 1e-9);
    squares += (p - Vec3(x0, y0, z0)).squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(squares / 32), 2 * std::sqrt(2.0), 0.7);  // along the bone: two axes
  EXPECT_EQ(some.file.landmarks.size(), 8u);
  for (const Landmark& landmark : some.file.landmarks) {
    const auto same = std::ranges::find(all.file.landmarks, landmark.site, &Landmark::site);
    EXPECT_EQ(landmark.point, same->point);
  }
}

TEST(LandmarksInUse, MissingNamesAreNotedAndTooFewAreRefused) {
  const TriMesh ball = SphereMesh({0, 0, 0}, 80, 60);
  const LandmarkFile file = OnBall(5);
  const UsedLandmarks used =
      LandmarksInUse(file, MeshQuery(ball),
                     {.keep = KeepNames{{file.landmarks[0].site, file.landmarks[1].site,
                                         file.landmarks[2].site, "go_r"}}});
  EXPECT_THAT(used.notes, ElementsAre(HasSubstr("no landmark at go_r"), HasSubstr("3 of 5")));
  EXPECT_THAT(WordsOf<InputError>(
                  [&] { LandmarksInUse(file, MeshQuery(ball), {.keep = KeepNames{{"go_r"}}}); }),
              HasSubstr("at least three"));
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
  // Points are denser on the left of the ridge; both sides have the same weight nevertheless.
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
  const Vec3 a = AveragedNormal(coarse, MeshQuery(coarse), nearest(coarse), ball);
  const Vec3 b = AveragedNormal(fine, MeshQuery(fine), nearest(fine), ball);
  EXPECT_LT(DegreesBetween(a, b), 1);
  EXPECT_GT(DegreesBetween(b, Vec3(0, 0, 1)), 5);  // more of the right side is within reach
}

TEST(AveragedNormal, IgnoresTheInnerSideOfAThinWall) {
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

TEST(AveragedNormal, IgnoresTheBackOfAThinWallNearItsRim) {
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

// A landmark on top of a ball with a normal that is tilted by so many degrees.
LandmarkFile TiltedOnTop(double tilt_deg) {
  const double tilt = tilt_deg * std::numbers::pi / 180;
  LandmarkFile file;
  file.subject = "ball";
  file.landmarks.resize(2);
  file.landmarks[0].site = "g";
  file.landmarks[0].point = {0, 0, 50};
  file.landmarks[0].normal = {std::sin(tilt), 0, std::cos(tilt)};
  file.landmarks[1].site = "n";
  file.landmarks[1].point = {50, 0, 0};
  return file;
}

TEST(DowelDirections, TheTurnIsTheAngleFromTheBonesOwnDirection) {
  const TriMesh ball = SphereMesh({0, 0, 0}, 50, 60);
  const MeshQuery query(ball);
  for (const double tilt_deg : {0.0, 12.0, 40.0, 74.0}) {
    const LandmarkFile file = TiltedOnTop(tilt_deg);
    const auto turns_deg = TurnsOfDowels(file, ball, query, {});
    ASSERT_EQ(turns_deg.size(), 1u) << "n has no direction of its own";
    EXPECT_NEAR(turns_deg.at("g"), tilt_deg, 0.2);
    const Dowel placed = PlaceDowels(file, ball, query, {}).front();
    EXPECT_NEAR((placed.direction - Vec3(file.landmarks[0].normal->data())).norm(), 0, 1e-12);
  }
}

TEST(DowelDirections, SidewaysAndIntoTheHeadAreRefused) {
  const TriMesh ball = SphereMesh({0, 0, 0}, 50, 60);
  const MeshQuery query(ball);
  for (const double tilt_deg : {77.0, 90.0, 135.0, 180.0}) {
    EXPECT_THAT([&] { TurnsOfDowels(TiltedOnTop(tilt_deg), ball, query, {}); },
                ::testing::ThrowsMessage<InputError>(::testing::AllOf(
                    HasSubstr("landmarks of ball: site g"), HasSubstr("at most 75"))));
  }
}

TEST(DowelDirections, OfAProposalNobodyHasConfirmedAreKept) {
  const TriMesh ball = SphereMesh({0, 0, 0}, 50, 60);
  LandmarkFile file = TiltedOnTop(120);
  file.proposed = true;
  EXPECT_NEAR(TurnsOfDowels(file, ball, MeshQuery(ball), {}).at("g"), 120, 0.2);
}

}  // namespace
}  // namespace semblance::problems
