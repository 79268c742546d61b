// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/hspline_surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/base/random.h"
#include "surfaces/hspline_query/tessellate.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/splines.h"

namespace semblance::surfaces {
namespace {

using testing::RandomSurface;
using testing::SmoothSurface;

class HSplineLaws : public ::testing::TestWithParam<HSplineShape> {
 protected:
  HSplineShape shape() const { return GetParam(); }
  double MaxDistance(const HSplineSurface& a, const HSplineSurface& b) const {
    Random random(5);
    double max = 0;
    for (int k = 0; k < 200; ++k) {
      const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
      max = std::max(max, (a.Point(uv) - b.Point(uv)).norm());
    }
    return max;
  }
};

// Oracle: Cox-de Boor on integer knots, by the definition.
double DeBoor(int i, int degree, double x) {
  if (degree == 0) {
    return x >= i && x < i + 1 ? 1 : 0;
  }
  return (x - i) / degree * DeBoor(i, degree - 1, x) +
         (i + degree + 1 - x) / degree * DeBoor(i + 1, degree - 1, x);
}

TEST_P(HSplineLaws, PointIsTheBSplineOfTheFinestNet) {
  const HSplineSurface surface = RandomSurface(shape(), 1);
  const int level = shape().max_level;
  const ControlNet& net = surface.Net(level);
  Random random(2);
  for (int k = 0; k < 50; ++k) {
    const Vec2 uv(random.Uniform(0, 0.999), random.Uniform(0, 0.999));
    Vec3 expected = Vec3::Zero();
    for (int j = 0; j < shape().PatchesV(level) + 3; ++j) {
      for (int i = 0; i < shape().PatchesU(level) + 3; ++i) {
        expected += DeBoor(i - 3, 3, uv.x() * shape().PatchesU(level)) *
                    DeBoor(j - 3, 3, uv.y() * shape().PatchesV(level)) *
                    net.At(i % net.columns, j % net.rows);
      }
    }
    EXPECT_LT((surface.Point(uv) - expected).norm(), 1e-10);
  }
}

// The derivative of x^n of the given order.
double Monomial(double x, int n, int order) {
  return order == 0 ? std::pow(x, n) : (n == 0 ? 0 : n * Monomial(x, n - 1, order - 1));
}

// The control value of x^n at a knot t of spacing h: its blossom at (t - h, t, t + h).
double MonomialVertex(double t, double h, int n) {
  return n == 0 ? 1 : n == 1 ? t : n == 2 ? t * t - h * h / 3 : t * (t * t - h * h);
}

TEST_P(HSplineLaws, StencilsReproduceCubicsAndTheirDerivatives) {
  if (shape().closure != Closure::kOpen) {
    GTEST_SKIP() << "a power of u is not periodic; the open shapes cover it";
  }
  Random random(3);
  for (int trial = 0; trial < 300; ++trial) {
    const int level = trial % (shape().max_level + 1), m = trial % 4, n = trial / 4 % 4;
    const DerivativeOrder order{trial % 3, trial / 3 % 3};
    const double hu = 1.0 / shape().PatchesU(level), hv = 1.0 / shape().PatchesV(level);
    const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
    const Stencil stencil = StencilAt(shape(), level, uv, order);
    double value = 0, size = 1;
    for (int k = 0; k < 16; ++k) {
      const int i = stencil.index[k] % shape().Columns(level),
                j = stencil.index[k] / shape().Columns(level);
      value += stencil.weight[k] * MonomialVertex((i - 1) * hu, hu, m) *
               MonomialVertex((j - 1) * hv, hv, n);
      size += std::abs(stencil.weight[k]);
    }
    EXPECT_NEAR(value, Monomial(uv.x(), m, order.u) * Monomial(uv.y(), n, order.v), 1e-13 * size)
        << "u^" << m << " v^" << n << " level " << level;
  }
}

TEST_P(HSplineLaws, WeightsSumToOneAndTheirDerivativesToZero) {
  Random random(3);
  for (int trial = 0; trial < 100; ++trial) {
    const int level = trial % (shape().max_level + 1);
    const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
    for (const DerivativeOrder order :
         {DerivativeOrder{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}}) {
      double sum = 0, size = 0;
      for (const double weight : StencilAt(shape(), level, uv, order).weight) {
        sum += weight;
        size += std::abs(weight);
      }
      EXPECT_NEAR(sum, order.u + order.v == 0 ? 1 : 0, 1e-14 * size);
    }
  }
}

TEST_P(HSplineLaws, RefinementKeepsTheShape) {
  const HSplineSurface surface = SmoothSurface(shape(), 4);
  Random random(4);
  for (int k = 0; k < 50; ++k) {
    const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
    for (int level = 1; level <= shape().max_level; ++level) {
      const Vec3 coarse = StencilAt(shape(), 0, uv).Apply(surface.Net(0));
      const Vec3 fine = StencilAt(shape(), level, uv).Apply(surface.Net(level));
      EXPECT_LT((coarse - fine).norm(), 1e-12 * 100);
    }
  }
}

TEST_P(HSplineLaws, AnEditTouchesTheFourPatchesOfItsParentLevelAndNothingElse) {
  const HSplineSurface before = RandomSurface(shape(), 5);
  HSplineSurface after = before;
  // odd: it lies on a vertex of level 1, the center of an overlay, near any seams
  const VertexId vertex{2, shape().ClosedU() ? 1 : 9, 9};
  after.SetOffsets({{vertex, Vec3(0, 0, 5)}});
  const Vec2 center = GrevillePoint(shape(), vertex);
  const auto apart = [](double a, double b, bool closed) {
    const double straight = std::abs(a - b);
    return closed ? std::min(straight, 1 - straight) : straight;
  };
  const double reach_u = 1.0 / shape().PatchesU(1), reach_v = 1.0 / shape().PatchesV(1);
  int touched = 0;
  for (int a = 0; a < 60; ++a) {
    for (int b = 0; b < 60; ++b) {
      const Vec2 uv((a + 0.5) / 60, (b + 0.5) / 60);
      constexpr double kBorder = 1e-12;  // a border belongs to the patches on both sides
      const bool inside = apart(uv.x(), center.x(), shape().ClosedU()) < reach_u + kBorder &&
                          apart(uv.y(), center.y(), false) < reach_v + kBorder;
      const double moved = (after.Point(uv) - before.Point(uv)).norm();
      EXPECT_TRUE(inside || moved == 0) << uv.transpose();
      touched += moved > 0;
    }
  }
  EXPECT_GT(touched, 5);
}

TEST_P(HSplineLaws, IsC2AcrossPatchBordersAndTheSeam) {
  const HSplineSurface surface = RandomSurface(shape(), 6);
  const double h = 1e-9;
  for (const double border : {0.25, 0.5, 2.0 / 16}) {
    for (const double other : {0.13, 0.77}) {
      for (const DerivativeOrder order :
           {DerivativeOrder{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}}) {
        const double size = 1 + surface.Derivative({0.3, 0.3}, order).norm();
        EXPECT_LT((surface.Derivative({border - h, other}, order) -
                   surface.Derivative({border + h, other}, order))
                      .norm(),
                  1e-4 * size);
        EXPECT_LT((surface.Derivative({other, border - h}, order) -
                   surface.Derivative({other, border + h}, order))
                      .norm(),
                  1e-4 * size);
        if (shape().ClosedU()) {
          EXPECT_LT(
              (surface.Derivative({1 - h, other}, order) - surface.Derivative({h, other}, order))
                  .norm(),
              1e-4 * size);
        }
      }
    }
  }
}

TEST_P(HSplineLaws, BothEndsOfAClosedDirectionAreOnePlace) {
  const HSplineSurface surface = RandomSurface(shape(), 13);
  const double end = std::nextafter(1.0, 0.0);
  for (const double other : {0.0, 0.13, 0.5, 0.77, end}) {
    for (const DerivativeOrder order :
         {DerivativeOrder{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}}) {
      const double size = 100 * std::pow(shape().PatchesU(shape().max_level), order.u + order.v);
      const auto off = [&](const Vec2& a, const Vec2& b) {
        return (surface.Derivative(a, order) - surface.Derivative(b, order)).norm() / size;
      };
      EXPECT_LT(shape().ClosedU() ? off({0, other}, {end, other}) : 0, 1e-13);
      EXPECT_EQ(shape().ClosedU() ? off({0, other}, {1, other}) : 0, 0);
    }
  }
}

TEST_P(HSplineLaws, DerivativesAgreeWithCentralDifferences) {
  const HSplineSurface surface = RandomSurface(shape(), 7);
  const double h = 1e-5;
  Random random(7);
  for (int k = 0; k < 20; ++k) {
    const Vec2 uv(random.Uniform(0.01, 0.99), random.Uniform(0.01, 0.99)), eu(h, 0), ev(0, h);
    const SurfaceFrame frame = surface.Frame(uv);
    EXPECT_LT(((surface.Point(uv + eu) - surface.Point(uv - eu)) / (2 * h) - frame.du).norm(),
              1e-4 * frame.du.norm());
    EXPECT_LT(((surface.Point(uv + ev) - surface.Point(uv - ev)) / (2 * h) - frame.dv).norm(),
              1e-4 * frame.dv.norm());
    const SecondDerivatives second = surface.Second(uv);
    const SurfaceFrame after = surface.Frame(uv + eu), before = surface.Frame(uv - eu);
    EXPECT_LT(((after.du - before.du) / (2 * h) - second.duu).norm(),
              1e-3 * (1 + second.duu.norm()));
    EXPECT_LT(((after.dv - before.dv) / (2 * h) - second.duv).norm(),
              1e-3 * (1 + second.duv.norm()));
    EXPECT_LT(
        ((surface.Frame(uv + ev).dv - surface.Frame(uv - ev).dv) / (2 * h) - second.dvv).norm(),
        1e-3 * (1 + second.dvv.norm()));
    EXPECT_LT((frame.axes.transpose() * frame.axes - Mat3::Identity()).norm(), 1e-12);
    EXPECT_NEAR(frame.axes.determinant(), 1, 1e-12);
  }
}

TEST_P(HSplineLaws, DetailFollowsARigidMotionOfLevelZero) {
  const HSplineSurface before = RandomSurface(shape(), 8);
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const Vec3 shift(10, -20, 30);
  ControlNet net = before.Net(0);
  for (Vec3& p : net.vertices) {
    p = turn * p + shift;
  }
  HSplineSurface after = before;
  after.SetNet(0, net);
  double worst = 0;
  for (double u = 0; u < 1; u += 0.07) {
    for (double v = 0; v < 1; v += 0.07) {
      worst = std::max(worst, (after.Point({u, v}) - (turn * before.Point({u, v}) + shift)).norm());
    }
  }
  if (shape().reference == OffsetReference::kFrame) {
    EXPECT_LT(worst, 1e-10);
  } else {
    EXPECT_GT(worst, 1e-2);  // offsets in the world's axes do not turn
  }
  EXPECT_EQ(after.Offsets(), before.Offsets());
}

TEST_P(HSplineLaws, SettingANetBackChangesNoBit) {
  const HSplineSurface before = RandomSurface(shape(), 9);
  for (int level = 0; level <= shape().max_level; ++level) {
    HSplineSurface after = before;
    after.SetNet(level, before.Net(level));
    EXPECT_EQ(after.Offsets(), before.Offsets());
    EXPECT_EQ(after.Net(shape().max_level).vertices, before.Net(shape().max_level).vertices);
  }
}

TEST_P(HSplineLaws, ASetNetIsReadBack) {
  for (int level = 0; level <= shape().max_level; ++level) {
    HSplineSurface surface = RandomSurface(shape(), 10);
    const std::map<VertexId, Vec3> old = surface.Offsets();
    ControlNet net = surface.Net(level);
    Random random(10);
    for (Vec3& p : net.vertices) {
      p += random.InBox(-0.5, 0.5);
    }
    surface.SetNet(level, net);
    for (std::size_t k = 0; k < net.vertices.size(); ++k) {
      EXPECT_LT((surface.Net(level).vertices[k] - net.vertices[k]).norm(), 1e-12 * 100);
    }
    for (const auto& [vertex, offset] : old) {
      EXPECT_TRUE(vertex.level == level ||
                  surface.Offset(vertex) == offset);  // other levels' detail is untouched
    }
  }
}

TEST_P(HSplineLaws, RemovedOffsetsRestoreTheCoarserSurface) {
  const HSplineSurface smooth = SmoothSurface(shape(), 11);
  HSplineSurface surface = RandomSurface(shape(), 11);
  EXPECT_GT(MaxDistance(smooth, surface), 0.01);
  std::map<VertexId, std::optional<Vec3>> none;
  for (const auto& [vertex, offset] : surface.Offsets()) {
    none[vertex] = std::nullopt;
  }
  surface.SetOffsets(none);
  EXPECT_EQ(MaxDistance(smooth, surface), 0);
}

TEST_P(HSplineLaws, TessellationLiesOnTheSurfaceAndIsConsistent) {
  const HSplineSurface surface = RandomSurface(shape(), 12);
  const Tessellation t = Tessellate(surface, 2);
  for (std::size_t v = 0; v < t.uv.size(); v += 17) {
    EXPECT_EQ(t.mesh.points[v], surface.Point(t.uv[v]));
  }
  const EdgeReport edges = CheckEdges(t.mesh);
  const int quads_u = 2 * shape().PatchesU(shape().max_level),
            quads_v = 2 * shape().PatchesV(shape().max_level);
  EXPECT_EQ(edges.boundary, 2 * quads_u + (shape().ClosedU() ? 0 : 2 * quads_v));
  EXPECT_EQ(edges.non_manifold + edges.inconsistent, 0);
  EXPECT_GT(TriangleAreaVector(t.mesh, t.mesh.triangles[5]).dot(t.normals[t.mesh.triangles[5][0]]),
            0);
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, HSplineLaws,
    ::testing::Values(
        HSplineShape{.patches_u = 4, .patches_v = 5, .max_level = 3},
        HSplineShape{
            .patches_u = 5, .patches_v = 4, .max_level = 2, .closure = Closure::kPeriodicU},
        HSplineShape{
            .patches_u = 4, .patches_v = 4, .max_level = 2, .reference = OffsetReference::kWorld}));

TEST(HSpline, ADegenerateFrameIsReportedAndNothingChanges) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 1};
  ControlNet flat{7, 7, std::vector<Vec3>(49, Vec3(1, 2, 3))};  // all in one point: no tangents
  HSplineSurface surface(shape, flat);
  EXPECT_THROW(surface.SetOffsets({{{1, 5, 5}, Vec3(0, 0, 1)}}), InputError);
  EXPECT_TRUE(surface.Offsets().empty());
}

TEST(HSpline, OneOffsetIsSetReadAndRemoved) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 2};
  HSplineSurface surface = SmoothSurface(shape, 1);
  const ControlNet untouched = surface.Net(2);
  surface.SetOffsets({{{1, 4, 5}, Vec3(1, 2, 3)}, {{2, 4, 5}, Vec3(4, 5, 6)}});
  EXPECT_EQ(surface.Offset({1, 4, 5}), Vec3(1, 2, 3));
  EXPECT_EQ(surface.Offsets(2), (std::map<VertexId, Vec3>{{{2, 4, 5}, Vec3(4, 5, 6)}}));
  EXPECT_EQ(surface.Offset({2, 5, 5}), std::nullopt);
  surface.SetOffsets({{{1, 4, 5}, std::nullopt}, {{2, 4, 5}, std::nullopt}});
  EXPECT_TRUE(surface.Offsets().empty());
  EXPECT_EQ(surface.Net(2).vertices, untouched.vertices);
}

TEST(HSpline, AnOffsetIsKeptInTheFrameOfTheCoarserSurface) {
  HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 1};
  for (const OffsetReference reference : {OffsetReference::kFrame, OffsetReference::kWorld}) {
    shape.reference = reference;
    HSplineSurface surface = SmoothSurface(shape, 2);
    const VertexId vertex{1, 5, 6};
    const Vec3 offset(0.5, -2, 3);
    const SurfaceFrame frame = surface.Frame(surface.GrevillePoint(vertex));
    surface.SetOffsets({{vertex, offset}});
    const Vec3 expected = reference == OffsetReference::kWorld
                              ? Vec3(frame.point + offset)
                              : Vec3(frame.point + frame.du.normalized() * offset.x() +
                                     frame.Normal().cross(frame.du.normalized()) * offset.y() +
                                     frame.du.cross(frame.dv).normalized() * offset.z());
    EXPECT_LT((surface.Net(1).At(5, 6) - expected).norm(), 1e-12);
  }
}

TEST(HSpline, AVertexHasItsLargestInfluenceAtItsGrevillePoint) {
  for (const Closure closure : {Closure::kOpen, Closure::kPeriodicU}) {
    const HSplineShape shape{.patches_u = 4, .patches_v = 5, .max_level = 1, .closure = closure};
    const int border_u = shape.ClosedU() ? 0 : 1, border_v = 1;
    for (int j = border_v; j < shape.Rows(1) - border_v; ++j) {
      for (int column = border_u; column < shape.Columns(1) - border_u; ++column) {
        const Stencil stencil = StencilAt(shape, 1, GrevillePoint(shape, {1, column, j}));
        const int most =
            static_cast<int>(std::max_element(stencil.weight.begin(), stencil.weight.end()) -
                             stencil.weight.begin());
        EXPECT_EQ(stencil.index[most], column + shape.Columns(1) * j);
      }
    }
  }
}

TEST(HSpline, ADegenerateLevelZeroUnderDetailIsReportedWithItsPlace) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 1};
  HSplineSurface surface = SmoothSurface(shape, 1);
  surface.SetOffsets({{{1, 5, 5}, Vec3(0, 0, 1)}});
  const HSplineSurface before = surface;
  ControlNet flat = surface.Net(0);
  flat.vertices.assign(flat.vertices.size(), Vec3(1, 2, 3));
  try {
    surface.SetNet(0, flat);
    ADD_FAILURE() << "accepted";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("(u,v) = (0.5, 0.5)"));
  }
  EXPECT_EQ(surface.Net(1).vertices, before.Net(1).vertices);
}

TEST(HSpline, ConstantCallsMayRunAtTheSameTime) {
  const HSplineSurface surface = RandomSurface({.patches_u = 4, .patches_v = 4, .max_level = 2}, 3);
  std::vector<Vec3> alone(400), together(400);
  const auto uv = [](std::size_t k) { return Vec2((k % 20) / 19.0, (k / 20) / 19.0); };
  for (std::size_t k = 0; k < alone.size(); ++k) {
    alone[k] = surface.Point(uv(k));
  }
  ParallelFor(together.size(), 4, 7, [&](std::size_t k) { together[k] = surface.Point(uv(k)); });
  EXPECT_EQ(alone, together);
}

TEST(HSpline, RefusesWhatDoesNotFit) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 1};
  EXPECT_THROW(HSplineSurface(shape, ControlNet{6, 7, std::vector<Vec3>(42)}), InputError);
  EXPECT_THROW(HSplineSurface({.patches_u = 3, .closure = Closure::kPeriodicU}, ControlNet{}),
               InputError);
  EXPECT_EQ(testing::WordsOf<InputError>([] {
              CheckShape({.patches_u = 3, .patches_v = 4, .closure = Closure::kPeriodicU});
            }),
            "H-spline: 3 x 4 patches are not allowed; with finest level 3, use 4..1024 x 1..1024");
  HSplineSurface surface = SmoothSurface(shape, 1);
  EXPECT_THROW(surface.SetOffsets({{{0, 1, 1}, Vec3(0, 0, 1)}}), InputError);
  EXPECT_THROW(surface.SetOffsets({{{1, 11, 1}, Vec3(0, 0, 1)}}), InputError);
  EXPECT_THROW(surface.Point({kNaN, 0.5}), InputError);
  EXPECT_THROW(surface.StencilAt(2, {0.5, 0.5}), InputError);
  EXPECT_THROW(HSplineSurface({.patches_u = 40, .max_level = 8}, ControlNet{}), InputError);
  ControlNet net = surface.Net(0);
  net.vertices[3].y() = kNaN;
  EXPECT_THROW(surface.SetNet(0, net), InputError);
}

}  // namespace
}  // namespace semblance::surfaces
