// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/thinning/kept_landmarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "problems/subject/landmarks.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/shapes.h"

namespace semblance {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
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

TEST(KeptLandmarks, ANumberIsKeptAndFewerAreAmongMore) {
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

TEST(LandmarksInUse, AllAsTheyAreUnlessAsked) {
  const TriMesh ball = testing::SphereMesh({0, 0, 0}, 80, 60);
  const UsedLandmarks used = LandmarksInUse(OnBall(32), MeshQuery(ball), {});
  EXPECT_EQ(used.file.landmarks.size(), 32u);
  EXPECT_THAT(used.notes, IsEmpty());
}

TEST(LandmarksInUse, NoiseHasItsSizeLiesOnTheBoneAndDoesNotDependOnWhatIsKept) {
  const TriMesh ball = testing::SphereMesh({0, 0, 0}, 80, 60);
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

TEST(LandmarksInUse, NamesThatLackAreSaidAndTooFewAreRefused) {
  const TriMesh ball = testing::SphereMesh({0, 0, 0}, 80, 60);
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

}  // namespace
}  // namespace semblance
