// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/polygon_integral.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using Corners = std::vector<Vec2>;  // counter-clockwise

// The polygon's edges relative to `foot`.
std::vector<EdgeFromFoot> EdgesFrom(const Corners& corners, const Vec2& foot) {
  std::vector<EdgeFromFoot> edges;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec2 from = corners[k] - foot, to = corners[(k + 1) % corners.size()] - foot;
    const Vec2 along = (to - from).normalized(), out(along.y(), -along.x());
    edges.push_back({from.dot(out), from.dot(along), to.dot(along)});
  }
  return edges;
}

// Subdivision with the midpoint rule: slow, simple and independent of the closed form.
double BruteForce(const Vec2& a, const Vec2& b, const Vec2& c, const Vec3& p, int n, int depth) {
  const Vec2 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
  if (depth == 0) {
    const double area =
        0.5 * std::abs((b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x()));
    double sum = 0;
    for (const Vec2& q : {ab, bc, ca}) {
      sum += std::pow((p - Vec3(q.x(), q.y(), 0)).norm(), -(n + 2)) / 3;
    }
    return area * sum;
  }
  return BruteForce(a, ab, ca, p, n, depth - 1) + BruteForce(ab, b, bc, p, n, depth - 1) +
         BruteForce(ca, bc, c, p, n, depth - 1) + BruteForce(ab, bc, ca, p, n, depth - 1);
}

class PolygonIntegral : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Powers, PolygonIntegral, ::testing::Values(1, 2, 3, 4, 7, 8, 15, 16));

TEST_P(PolygonIntegral, EqualsBruteForce) {
  Random random(11);
  for (int trial = 0; trial < 12; ++trial) {
    const Vec2 a(random.Uniform(-1, 1), random.Uniform(-1, 1));
    const Vec2 b = a + Vec2(random.Uniform(0.3, 2), random.Uniform(-0.2, 0.2));
    const Vec2 c = a + Vec2(random.Uniform(-0.5, 2), random.Uniform(0.5, 2));
    const Vec3 p(random.Uniform(-1, 2), random.Uniform(-1, 2), random.Uniform(0.6, 2));
    const double exact = BruteForce(a, b, c, p, GetParam(), 8);
    EXPECT_NEAR(IntegrateInversePower(EdgesFrom({a, b, c}, p.head<2>()), p.z(), GetParam()) / exact,
                1, 1e-6);
  }
}

// Over a corner, an edge and the edge's line, where single terms have no limit.
TEST_P(PolygonIntegral, IsFiniteOverCornersAndEdges) {
  const Corners triangle = {{0, 0}, {2, 0}, {0, 1}};
  for (const Vec2& foot : {Vec2(0, 0), Vec2(2, 0), Vec2(1, 0), Vec2(3, 0), Vec2(0, 0.25)}) {
    const Vec3 p(foot.x(), foot.y(), 1);
    const double exact = BruteForce(triangle[0], triangle[1], triangle[2], p, GetParam(), 8);
    EXPECT_NEAR(IntegrateInversePower(EdgesFrom(triangle, foot), 1, GetParam()) / exact, 1, 1e-6);
  }
}

// In polar coordinates the integral over the plane is 2 pi / (n height^n).
TEST_P(PolygonIntegral, AVastPolygonIsThePlane) {
  const int n = GetParam();
  const Corners square = {{-1e8, -1e8}, {1e8, -1e8}, {1e8, 1e8}, {-1e8, 1e8}};
  EXPECT_NEAR(IntegrateInversePower(EdgesFrom(square, {3, 4}), 2, n) * n * std::pow(2, n) /
                  (2 * std::acos(-1.0)),
              1, 1e-7);
}

TEST_P(PolygonIntegral, PartsAddUp) {
  const Corners left = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, right = {{1, 0}, {3, 0}, {3, 1}, {1, 1}},
                whole = {{0, 0}, {3, 0}, {3, 1}, {0, 1}};
  const auto over = [&](const Corners& corners) {
    return IntegrateInversePower(EdgesFrom(corners, {0.7, 0.3}), 0.5, GetParam());
  };
  EXPECT_NEAR((over(left) + over(right)) / over(whole), 1, 1e-12);
}

}  // namespace
}  // namespace semblance::surfaces
