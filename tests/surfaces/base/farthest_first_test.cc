// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/farthest_first.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "surfaces/base/random.h"

namespace semblance::surfaces {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAre;

double ToNearest(const std::vector<Vec3>& points, const std::vector<std::size_t>& some,
                 std::size_t count, std::size_t k) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t n = 0; n < count; ++n) {
    nearest = std::min(nearest, (points[some[n]] - points[k]).norm());
  }
  return nearest;
}

TEST(FarthestFirst, EachIsAsFarAsAnyFromThoseBeforeIt) {
  Random random(3);
  std::vector<Vec3> points;
  for (int k = 0; k < 60; ++k) {
    points.push_back(random.InBox(-1, 1));
  }
  const std::vector<std::size_t> some = FarthestFirst(points, 17, 25);
  ASSERT_EQ(some.size(), 25u);
  EXPECT_EQ(some[0], 17u);
  for (std::size_t n = 1; n < some.size(); ++n) {
    for (std::size_t k = 0; k < points.size(); ++k) {
      ASSERT_GE(ToNearest(points, some, n, some[n]), ToNearest(points, some, n, k));
    }
  }
}

TEST(FarthestFirst, NoneTwiceWherePointsCoincide) {
  const std::vector<Vec3> points = {Vec3(1, 0, 0), Vec3(1, 0, 0), Vec3(0, 0, 0), Vec3(1, 0, 0)};
  EXPECT_THAT(FarthestFirst(points, 0, 2), ElementsAre(0, 2));
  EXPECT_THAT(FarthestFirst(points, 0, 9), UnorderedElementsAre(0, 1, 2, 3));
  EXPECT_THAT(FarthestFirst(points, 0, 9, Coincident::kLeftOut), SizeIs(2));
  EXPECT_THAT(FarthestFirst({}, 0, 3), IsEmpty());
}

}  // namespace
}  // namespace semblance::surfaces
