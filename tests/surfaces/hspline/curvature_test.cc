// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/hspline_surface.h"

#include <gtest/gtest.h>

#include <functional>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/splines.h"

namespace semblance::surfaces {
namespace {

using testing::RandomSurface;

// z = a x^2 + b y^2 over [-10, 10]^2, exactly: the vertex of x^2 is x^2 - h^2 / 3.
HSplineSurface Paraboloid(double a, double b) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 5, .max_level = 2};
  ControlNet net{shape.Columns(0), shape.Rows(0), {}};
  const double hx = 20.0 / shape.patches_u, hy = 20.0 / shape.patches_v;
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      const double x = (i - 1) * hx - 10, y = (j - 1) * hy - 10;
      net.vertices.emplace_back(x, y, a * (x * x - hx * hx / 3) + b * (y * y - hy * hy / 3));
    }
  }
  return HSplineSurface(shape, net);
}

TEST(Curvature, OfAParaboloidIsItsClosedForm) {
  const double a = 0.03, b = -0.05;
  const HSplineSurface surface = Paraboloid(a, b);
  Random random(1);
  for (int k = 0; k < 200; ++k) {
    const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
    const double x = 20 * uv.x() - 10, y = 20 * uv.y() - 10;
    const double area = 1 + 4 * a * a * x * x + 4 * b * b * y * y;
    const auto curvature = CurvatureAt(surface, uv);
    ASSERT_TRUE(curvature);
    EXPECT_NEAR(curvature->GaussianPerMm2(), 4 * a * b / (area * area), 1e-13);
    EXPECT_NEAR(curvature->MeanPerMm(),
                (a * (1 + 4 * b * b * y * y) + b * (1 + 4 * a * a * x * x)) / std::pow(area, 1.5),
                1e-12);
    EXPECT_NEAR(surface.Frame(uv).Jacobian(), 400 * std::sqrt(area), 1e-9);
  }
}

TEST(Curvature, OfACylinderIsThatOfItsCircle) {
  const HSplineShape shape{
      .patches_u = 64, .patches_v = 3, .max_level = 1, .closure = Closure::kPeriodicU};
  ControlNet net{shape.Columns(0), shape.Rows(0), {}};
  const double radius = 40;
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      const double angle = 2 * std::numbers::pi * i / net.columns;
      net.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 10 * j);
    }
  }
  const auto curvature = CurvatureAt(HSplineSurface(shape, net), {0.3, 0.4});
  ASSERT_TRUE(curvature);
  EXPECT_NEAR(curvature->smallest_per_mm, -1 / radius, 0.01 / radius);  // outward normals
  EXPECT_NEAR(curvature->largest_per_mm, 0, 1e-12);
  EXPECT_NEAR(std::abs(curvature->largest_direction.z()), 1, 1e-9);
}

TEST(Curvature, IsHowTheNormalTurnsAlongThePrincipalDirections) {
  const HSplineSurface surface = RandomSurface({.patches_u = 4, .patches_v = 5, .max_level = 2}, 3);
  Random random(3);
  for (int k = 0; k < 100; ++k) {
    const Vec2 uv(random.Uniform(0.1, 0.9), random.Uniform(0.1, 0.9));
    const auto curvature = CurvatureAt(surface, uv);
    ASSERT_TRUE(curvature);
    const SurfaceFrame frame = surface.Frame(uv);
    Eigen::Matrix<double, 3, 2> tangents;
    tangents << frame.du, frame.dv;
    const auto turn = [&](const Vec3& direction) {  // change of the normal per mm
      const double h = 1e-3;
      const Vec2 step = h * tangents.colPivHouseholderQr().solve(direction);
      return Vec3((surface.Normal(uv + step) - surface.Normal(uv - step)) / (2 * h));
    };
    const double size = 1 + std::abs(curvature->largest_per_mm - curvature->smallest_per_mm);
    EXPECT_LT((turn(curvature->largest_direction) +
               curvature->largest_per_mm * curvature->largest_direction)
                  .norm(),
              1e-4 * size);
    EXPECT_LT((turn(curvature->smallest_direction) +
               curvature->smallest_per_mm * curvature->smallest_direction)
                  .norm(),
              1e-4 * size);
    EXPECT_NEAR(curvature->largest_direction.dot(frame.Normal()), 0, 1e-12);
  }
}

TEST(Curvature, ScalesInverselyWithTheSurface) {
  const HSplineSurface surface = RandomSurface({.patches_u = 4, .patches_v = 5, .max_level = 0}, 4);
  ControlNet net = surface.Net(0);
  for (Vec3& p : net.vertices) {
    p *= 4;
  }
  const HSplineSurface larger(surface.shape(), net);
  const auto one = CurvatureAt(surface, {0.3, 0.6}), four = CurvatureAt(larger, {0.3, 0.6});
  ASSERT_TRUE(one && four);
  EXPECT_NEAR(one->largest_per_mm, 4 * four->largest_per_mm, 1e-12);
  EXPECT_NEAR(one->GaussianPerMm2(), 16 * four->GaussianPerMm2(), 1e-12);
}

// Surfaces with places without a frame: a point, a line, a pole (a row of vertices in one point).
HSplineSurface Degenerate(const std::function<Vec3(int i, int j)>& vertex) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 1};
  ControlNet net{7, 7, {}};
  for (int j = 0; j < 7; ++j) {
    for (int i = 0; i < 7; ++i) {
      net.vertices.push_back(vertex(i, j));
    }
  }
  return HSplineSurface(shape, net);
}

TEST(Curvature, DegenerateFramesGiveNoCurvatureAndNoNaN) {
  for (const HSplineSurface& surface :
       {Degenerate([](int, int) { return Vec3(1, 2, 3); }),
        Degenerate([](int i, int j) { return Vec3(i + j, 2 * (i + j), 7); }),
        Degenerate([](int i, int j) {
          const double r = std::max(j - 2, 0);
          return Vec3(r * std::cos(i), r * std::sin(i), 5.3);
        })}) {
    const Vec2 uv(0.37, 0.0);
    const SurfaceFrame frame = surface.Frame(uv);
    EXPECT_FALSE(frame.regular);
    EXPECT_EQ(frame.axes, Mat3::Zero());
    EXPECT_EQ(surface.Normal(uv), Vec3::Zero());
    EXPECT_TRUE(frame.point.allFinite() && frame.du.allFinite() && frame.dv.allFinite());
    EXPECT_FALSE(CurvatureAt(surface, uv));
  }
  EXPECT_THROW(CurvatureAt(Paraboloid(0, 0), {kNaN, 0}), InputError);
}

}  // namespace
}  // namespace semblance::surfaces
