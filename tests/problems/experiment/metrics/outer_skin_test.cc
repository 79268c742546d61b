// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/outer_skin.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "surfaces/base/error.h"
#include "surfaces/marching/polygonize.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using testing::Joined;
using testing::SphereMesh;

// Positive inside; cells of 2 mm in a box around the origin. `closed`: the box's faces are outside.
TriMesh Solid(double half_mm, double lowest_mm, const std::function<double(const Vec3&)>& inside,
              bool closed = true) {
  const int n = static_cast<int>(half_mm);
  const int nz = static_cast<int>((half_mm - lowest_mm) / 2);
  SampleGrid grid{Vec3(-half_mm, -half_mm, lowest_mm), Vec3::Constant(2), {n + 1, n + 1, nz + 1}};
  std::vector<float> samples;
  for (std::int64_t k = 0; k < grid.CornerCount(); ++k) {
    const auto at = grid.At(k);
    const bool rim = closed && at[2] == 0;
    samples.push_back(rim ? -1.0F : static_cast<float>(inside(grid.Corner(at[0], at[1], at[2]))));
  }
  return PolygonizeSamples(samples, grid, {}).mesh;
}

double Ball(const Vec3& p) { return 40 - p.norm(); }
double Bore(const Vec3& p, double radius_mm) { return radius_mm - p.head<2>().norm(); }

TEST(OuterSkin, AClosedBallIsOuterEverywhere) {
  const OuterSkin skin = FindOuterSkin(SphereMesh({10, 20, 30}, 80, 40), 6);
  EXPECT_EQ(std::ranges::count(skin.outer, false), 0);
  EXPECT_TRUE(skin.ends.empty());
}

TEST(OuterSkin, AnInnerCavityIsNotOuter) {
  const TriMesh outside = SphereMesh({0, 0, 0}, 80, 40);
  TriMesh cavity = SphereMesh({0, 0, 0}, 40, 20);
  for (Triangle& t : cavity.triangles) {
    std::swap(t[0], t[1]);
  }
  const OuterSkin skin = FindOuterSkin(Joined(outside, cavity), 6);
  for (std::size_t v = 0; v < skin.outer.size(); ++v) {
    EXPECT_EQ(skin.outer[v], v < outside.points.size());
  }
}

TEST(OuterSkin, ABallGoesIntoABoreThatIsWideEnough) {
  // A bore of 10 mm across, down to the middle of the ball.
  const TriMesh bored = Solid(
      44, -44, [](const Vec3& p) { return std::min(Ball(p), std::max(-Bore(p, 5), -p.z())); });
  const OuterSkin coarse = FindOuterSkin(bored, 6), fine = FindOuterSkin(bored, 2);
  int walls = 0, reached = 0;
  for (std::size_t v = 0; v < bored.points.size(); ++v) {
    const Vec3& p = bored.points[v];
    if (p.head<2>().norm() < 6 && p.z() > 6 && p.z() < 30) {
      ++walls;
      reached += fine.outer[v];
      EXPECT_FALSE(coarse.outer[v]) << p.transpose();
    }
    if (p.norm() > 39 && p.head<2>().norm() > 10) {
      EXPECT_TRUE(coarse.outer[v] && fine.outer[v]) << p.transpose();
    }
  }
  EXPECT_GT(walls, 50);
  EXPECT_GT(reached, 0.8 * walls);  // the mesh's bore has corners
}

// A ball of 6 mm that touches two of 40 mm, 72 mm apart, meets them 4.7 mm from the plane between.
TEST(OuterSkin, EndsWhereTheBallTouchesBothSidesOfAFold) {
  const TriMesh pair = Solid(80, -44, [](const Vec3& p) {
    return std::max(Ball(p - Vec3(36, 0, 0)), Ball(p + Vec3(36, 0, 0)));
  });
  const OuterSkin skin = FindOuterSkin(pair, 6);
  for (std::size_t v = 0; v < pair.points.size(); ++v) {
    const double x = std::abs(pair.points[v].x());
    if (x < 1 || x > 6) {
      EXPECT_EQ(skin.outer[v], x > 6) << pair.points[v].transpose();
    }
  }
}

TEST(OuterSkin, ALidIsAnEndAndNotOuter) {
  const TriMesh cut = Solid(44, -20, Ball);
  const OuterSkin skin = FindOuterSkin(cut, 6);
  ASSERT_EQ(skin.ends.size(), 1u);
  EXPECT_EQ(ToPhrase(skin.ends[0]).substr(0, 3), "z =");
  for (std::size_t v = 0; v < cut.points.size(); ++v) {
    const Vec3& p = cut.points[v];
    if (p.z() > -16 || (p.z() < -18 && p.head<2>().norm() < 30)) {
      EXPECT_EQ(skin.outer[v], p.z() > -16) << p.transpose();
    }
  }
}

TEST(OuterSkin, AnAirwayThatACutOpensIsNotOuter) {
  const auto windpipe = [](const Vec3& p) {
    return std::min(Ball(p), std::max(-Bore(p, 10), p.z() - 20));
  };
  for (const bool closed : {true, false}) {
    const TriMesh cut = Solid(44, -20, windpipe, closed);
    const OuterSkin skin = FindOuterSkin(cut, 6);
    ASSERT_FALSE(skin.ends.empty());
    for (std::size_t v = 0; v < cut.points.size(); ++v) {
      const Vec3& p = cut.points[v];
      if (p.z() > -16 && p.norm() < 37) {
        EXPECT_FALSE(skin.outer[v]) << p.transpose();
      }
    }
  }
}

// A skin of two layers: the wall of a sinus or airway behind it, and a hole in the outer layer that
// is wider than the ball.
TEST(OuterSkin, AWallBehindAHoleIsNotOuter) {
  const TriMesh closed = SphereMesh({0, 0, 0}, 80, 60);
  TriMesh wall = SphereMesh({0, 0, 0}, 60, 40);
  for (Triangle& t : wall.triangles) {
    std::swap(t[0], t[1]);
  }
  TriMesh skin = Joined(closed, wall);
  const auto is_in_hole = [&](const Triangle& t) {
    const Vec3 middle = TriangleCentroid(skin, t);
    return middle.norm() > 70 && middle.head<2>().norm() < 15 && middle.z() > 0;
  };
  ASSERT_GT(std::erase_if(skin.triangles, is_in_hole), 10U);
  const OuterSkin found = FindOuterSkin(skin, 6);
  EXPECT_TRUE(found.ends.empty());
  for (std::size_t v = 0; v < skin.points.size(); ++v) {
    const Vec3& p = skin.points[v];
    if (p.z() < 0 || p.head<2>().norm() > 20 || p.norm() < 70) {  // beside the hole's rim
      EXPECT_EQ(found.outer[v], p.norm() > 70) << p.transpose();
    }
  }
}

TEST(OuterSkin, RefusesWhatIsNoHead) {
  EXPECT_THROW(FindOuterSkin(TriMesh{}, 6), InputError);
  EXPECT_THROW(FindOuterSkin(SphereMesh({0, 0, 0}, 1e6, 10), 6), InputError);
}

}  // namespace
}  // namespace semblance::problems
