// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/identification.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "problems/subject/phantom.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

using ::testing::ElementsAre;

KnownFace PersonOf(std::uint64_t random_seed) {
  const Phantom phantom = MakePhantom({.random_seed = random_seed, .rings = 30});
  KnownFace known{.name = "person", .skin = phantom.face, .region = {}, .points = {}};
  known.region.part.resize(phantom.face.points.size(), 0);
  for (const Vec3& p : phantom.face.points) {
    known.region.scored.push_back(p.y() < 60);
  }
  for (const PhantomSite& s : phantom.sites) {
    known.points.emplace_back(s.site, s.base + s.depth_mm * s.normal);
  }
  return known;
}

TEST(Identification, TheRankIsOnePlusThoseThatAreCloser) {
  const std::vector<double> distances = {3, 1, 2, 4};
  EXPECT_EQ(FindRank(distances, 1), 1);
  EXPECT_EQ(FindRank(distances, 2), 2);
  EXPECT_EQ(FindRank(distances, 3), 4);
}

TEST(Identification, TiesGetTheMeanRankAndWhatIsNotFiniteComesLast) {
  EXPECT_EQ(FindRank(std::vector<double>{5, 5, 5, 5, 5}, 2), ChanceRank(5));
  EXPECT_EQ(FindRank(std::vector<double>{kNaN, 1, 2}, 0), 3);
}

TEST(Identification, TheCurveRisesToOne) {
  const std::vector<double> ranks = {1, 3, 1, 4};
  EXPECT_THAT(CumulativeMatch(ranks, 4), ElementsAre(0.5, 0.5, 0.75, 1));
  Random random(2);
  std::vector<double> any;
  for (int k = 0; k < 50; ++k) {
    any.push_back(1 + static_cast<double>(random.Index(20)));
  }
  const std::vector<double> curve = CumulativeMatch(any, 20);
  EXPECT_TRUE(std::ranges::is_sorted(curve));
  EXPECT_EQ(curve.back(), 1);
}

// With one face for everyone the distances do not depend on the person sought, so the ranks are 1
// ... n.
TEST(Identification, OneFaceForAllRanksByChance) {
  const std::vector<double> distances = {4, 2, 9, 1, 7};
  double sum = 0;
  std::vector<double> ranks;
  for (std::size_t own = 0; own < distances.size(); ++own) {
    ranks.push_back(FindRank(distances, own));
    sum += ranks.back();
  }
  EXPECT_EQ(sum / 5, ChanceRank(5));
  EXPECT_THAT(CumulativeMatch(ranks, 5), ElementsAre(0.2, 0.4, 0.6, 0.8, 1));
}

TEST(Identification, TheSameFaceIsNoDistanceAwayWhereverItLies) {
  const KnownFace known = PersonOf(1);
  const Similarity away = {
      .scale = 1,
      .rotation = Eigen::AngleAxisd(0.8, Vec3(1, 2, 3).normalized()).toRotationMatrix(),
      .translation = {100, -50, 20}};
  ProbeFace probe{.mesh = Transformed(known.skin, away), .points = known.points};
  for (auto& [site, point] : probe.points) {
    point = away * point;
  }
  const FaceDistance distance = MeasureFaceDistance(probe, known, {});
  EXPECT_LT(distance.surface_mm, 1e-3);
  EXPECT_LT(distance.landmarks_mm, 1e-9);
}

TEST(Identification, ALargerFaceIsAnotherFace) {
  const KnownFace known = PersonOf(1);
  const Similarity larger = {.scale = 1.05, .rotation = Mat3::Identity(), .translation = {0, 0, 0}};
  ProbeFace probe{.mesh = Transformed(known.skin, larger), .points = known.points};
  for (auto& [site, point] : probe.points) {
    point = larger * point;
  }
  const FaceDistance distance = MeasureFaceDistance(probe, known, {});
  EXPECT_GT(distance.surface_mm, 0.5);
  EXPECT_GT(distance.landmarks_mm, 2);
}

TEST(Identification, SeenAgainAFaceIsCloserToItselfThanToAnother) {
  const KnownFace one = PersonOf(1), two = PersonOf(2);
  const ProbeFace again = SimulateRescan(one, 3, 0.5, 7);
  const FaceDistance own = MeasureFaceDistance(again, one, {}),
                     other = MeasureFaceDistance(again, two, {});
  EXPECT_GT(own.surface_mm, 0.05);
  EXPECT_LT(own.surface_mm, other.surface_mm);
  EXPECT_LT(own.landmarks_mm, other.landmarks_mm);
}

TEST(Identification, WithoutCommonLandmarksThereIsNoDistance) {
  const KnownFace known = PersonOf(1);
  EXPECT_THROW(MeasureFaceDistance({.mesh = known.skin, .points = {}}, known, {}), InputError);
}

}  // namespace
}  // namespace semblance::problems
