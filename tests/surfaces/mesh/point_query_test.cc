// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/point_query.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance {
namespace {

// Points in clusters, some of them twice.
std::vector<Vec3> Clusters() {
  Random random(1);
  std::vector<Vec3> points;
  for (int k = 0; k < 20; ++k) {
    const Vec3 centre = random.InBox(-50, 50);
    for (int m = 0; m < 30; ++m) {
      points.push_back(centre + random.InBox(-1, 1));
    }
    points.push_back(points.back());
  }
  return points;
}

TEST(PointQuery, FindsWhatLookingAtEveryPointFinds) {
  const std::vector<Vec3> points = Clusters();
  const PointQuery query(points);
  Random random(2);
  for (int k = 0; k < 200; ++k) {
    const Vec3 p = k % 2 == 0 ? random.InBox(-60, 60) : points[k];
    std::vector<double> distances;
    for (const Vec3& point : points) {
      distances.push_back((point - p).norm());
    }
    std::ranges::sort(distances);
    for (const int rank : {1, 2, 9, static_cast<int>(points.size())}) {
      EXPECT_NEAR(query.DistanceTo(p, rank), distances[rank - 1], 1e-12) << k << ' ' << rank;
    }
  }
}

TEST(PointQuery, APointThatIsNotThereIsInfinitelyFar) {
  const std::vector<Vec3> points = {Vec3(1, 2, 3)};
  EXPECT_EQ(PointQuery(points).DistanceTo(Vec3(1, 2, 5)), 2);
  EXPECT_TRUE(std::isinf(PointQuery(points).DistanceTo(Vec3(1, 2, 5), 2)));
}

TEST(PointQuery, PointsThatCoincideAreFound) {
  const std::vector<Vec3> points(1000, Vec3(1, 0, 0));
  EXPECT_EQ(PointQuery(points).DistanceTo(Vec3::Zero(), 1000), 1);
}

TEST(PointQuery, RefusesNoneAndNotFinite) {
  EXPECT_THROW(PointQuery({}), InputError);
  const std::vector<Vec3> points = {Vec3::Zero(), Vec3(0, kNaN, 0)};
  EXPECT_THROW(PointQuery{points}, InputError);
}

}  // namespace
}  // namespace semblance
