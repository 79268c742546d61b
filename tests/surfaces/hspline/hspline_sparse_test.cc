// SPDX-License-Identifier: GPL-3.0-or-later
// H-splines down to level 8, compared with the sum of the B-splines of all levels, computed by
// their defining recursion.
#include <gtest/gtest.h>

#include <cmath>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/hspline/patch_tree.h"
#include "tests/testing/splines.h"

namespace semblance::surfaces {
namespace {

using testing::SmoothSurface;

// The cardinal B-spline of the degree, on [0, degree + 1], or its derivative.
double Cardinal(double x, int degree, int order) {
  if (order > 0) {
    return Cardinal(x, degree - 1, order - 1) - Cardinal(x - 1, degree - 1, order - 1);
  }
  if (x < 0 || x >= degree + 1) {
    return 0;
  }
  return degree == 0 ? 1
                     : (x * Cardinal(x, degree - 1, 0) +
                        (degree + 1 - x) * Cardinal(x - 1, degree - 1, 0)) /
                           degree;
}

// S = sum over levels and vertices of (vertex - its value refined from the coarser level) B(u,v).
class Oracle {
 public:
  explicit Oracle(const HSplineSurface& level0) : shape_(level0.shape()) {
    const ControlNet net = level0.Net(0);
    for (int i = 0; i < net.columns; ++i) {
      for (int j = 0; j < net.rows; ++j) {
        parts_[{0, i, j}] = net.At(i, j);
      }
    }
  }

  Vec3 Eval(int level, const Vec2& uv, DerivativeOrder order = {}) const {
    Vec3 sum = Vec3::Zero();
    for (const auto& [id, part] : parts_) {
      if (id.level <= level) {
        sum += Along(uv.x(), id.i, shape_.PatchesU(id.level), order.u, shape_.ClosedU()) *
               Along(uv.y(), id.j, shape_.PatchesV(id.level), order.v, false) * part;
      }
    }
    return sum;
  }

  // Sets all edits of one level at once, in order of levels. The vertices' knots lie inside the
  // domain.
  void Add(int level, const std::map<VertexId, Vec3>& offsets) {
    std::map<VertexId, Vec3> parts;
    for (const auto& [id, offset] : offsets) {
      const double hu = 1.0 / shape_.PatchesU(level), hv = 1.0 / shape_.PatchesV(level);
      const Vec2 uv((id.i - 1) * hu, (id.j - 1) * hv);
      const auto s = [&](int du, int dv) { return Eval(level - 1, uv, {du, dv}); };
      const Vec3 du = s(1, 0).normalized(), n = s(1, 0).cross(s(0, 1)).normalized();
      Mat3 axes = Mat3::Identity();
      if (shape_.reference == OffsetReference::kFrame) {
        axes << du, n.cross(du), n;
      }
      // The control value of a cubic at its knot is f - h^2 f'' / 6, along u and along v.
      const double a = hu * hu / 6, b = hv * hv / 6;
      const Vec3 refined = s(0, 0) - a * s(2, 0) - b * s(0, 2) + a * b * s(2, 2);
      parts[id] = s(0, 0) + axes * offset - refined;
    }
    parts_.merge(parts);
  }

 private:
  static double Along(double x, int vertex, int patches, int order, bool periodic) {
    double sum = 0;
    for (const int turn : {-1, 0, 1}) {
      sum += turn == 0 || periodic ? Cardinal(x * patches - (vertex - 3) + turn * patches, 3, order)
                                   : 0;
    }
    return sum * std::pow(patches, order);
  }

  HSplineShape shape_;
  std::map<VertexId, Vec3> parts_;
};

class DeepHSpline : public ::testing::TestWithParam<HSplineShape> {
 protected:
  static constexpr int kFinest = 8;
  const HSplineShape& shape() const { return GetParam(); }

  // The vertex of a level whose Greville point is nearest to a (u,v).
  VertexId Near(int level, const Vec2& uv) const {
    return {
        level,
        shape().Column(level, static_cast<int>(std::round(uv.x() * shape().PatchesU(level))) + 1),
        static_cast<int>(std::round(uv.y() * shape().PatchesV(level))) + 1};
  }

  // Edits a few vertices per level around a (u,v), and one elsewhere.
  std::map<VertexId, Vec3> Detail(const Vec2& place) const {
    Random random(5);
    std::map<VertexId, Vec3> detail;
    for (int level = 1; level <= kFinest; ++level) {
      const VertexId center = Near(level, place);
      for (const int step : {-1, 0, 2}) {
        const int i = shape().Column(level, center.i + step), j = center.j + (step + 1) / 2;
        detail[{level, i, j}] = std::ldexp(1, -level) * random.InBox(-4, 4);
      }
      detail[Near(level, {random.Uniform(0.2, 0.8), random.Uniform(0.2, 0.8)})] =
          std::ldexp(1, -level) * random.InBox(-4, 4);
    }
    return detail;
  }

  static void Apply(const std::map<VertexId, Vec3>& detail, HSplineSurface& surface) {
    surface.SetOffsets({detail.begin(), detail.end()});
  }
};

TEST_P(DeepHSpline, EqualsTheSumOfTheBSplinesOfAllLevels) {
  const Vec2 place(shape().ClosedU() ? 0.999 : 0.37, 0.61);
  HSplineSurface surface = SmoothSurface(shape(), 1);
  Oracle oracle(surface);
  const std::map<VertexId, Vec3> detail = Detail(place);
  Apply(detail, surface);
  for (int level = 1; level <= kFinest; ++level) {
    oracle.Add(level, surface.Offsets(level));
  }
  ASSERT_EQ(surface.Offsets(), detail);
  Random random(6);
  for (int trial = 0; trial < 120; ++trial) {
    const double reach = std::ldexp(1, -trial % 11);
    Vec2 uv = place + reach * Vec2(random.Uniform(-0.5, 0.5), random.Uniform(-0.5, 0.5));
    uv = {uv.x() - std::floor(uv.x()), std::clamp(uv.y(), 0.0, 0.999)};
    for (const DerivativeOrder order :
         {DerivativeOrder{}, {1, 0}, {0, 1}, {1, 1}, {2, 0}, {0, 2}}) {
      const double scale = std::pow(shape().PatchesU(kFinest), order.u + order.v);
      EXPECT_LT((surface.Derivative(uv, order) - oracle.Eval(kFinest, uv, order)).norm(),
                1e-12 * 100 * scale)
          << uv.transpose() << " orders " << order.u << " " << order.v;
    }
    for (int level = 0; level < kFinest; ++level) {
      EXPECT_LT((surface.LevelDerivative(level, uv) - oracle.Eval(level, uv)).norm(), 1e-12 * 100);
    }
  }
}

TEST_P(DeepHSpline, RefinementToLevelEightNeverChangesTheShape) {
  const HSplineSurface before = SmoothSurface(shape(), 2);
  HSplineSurface after = before;
  const Vec2 place(shape().ClosedU() ? 0.998 : 0.43, 0.52);
  for (int level = 1; level <= kFinest;
       ++level) {  // an overlay whose vertices are the refined ones
    const VertexId center = Near(level, place);
    const PatchId patch{level, shape().Column(level, center.i - 1), center.j - 1};
    const Vec3 refined = after.PatchVertices(patch)[5];
    const SurfaceFrame frame = after.LevelFrame(level - 1, after.GrevillePoint(center));
    const bool world = shape().reference == OffsetReference::kWorld;
    const Mat3 axes = world ? Mat3::Identity() : frame.axes;
    after.SetOffsets({{center, Vec3(axes.transpose() * (refined - frame.point))}});
  }
  ASSERT_EQ(after.Offsets().size(), 8u);
  double size = 0, worst = 0;
  for (int k = 0; k < 4000; ++k) {
    const double reach = std::ldexp(1, -k % 11);
    const Vec2 uv = place + reach * Vec2((k % 63) / 62.0 - 0.5, (k % 61) / 60.0 - 0.5) * 0.9;
    size = std::max(size, before.Point(uv).norm());
    worst = std::max(worst, (after.Point(uv) - before.Point(uv)).norm());
  }
  EXPECT_LT(worst, 1e-12 * size);
}

TEST_P(DeepHSpline, AnEditOfLevelEightMovesItsOverlayAndNotOneBitElsewhere) {
  HSplineSurface before = SmoothSurface(shape(), 3);
  Apply(Detail({0.37, 0.61}), before);
  HSplineSurface after = before;
  VertexId vertex = Near(kFinest, {0.52, 0.33});
  vertex.i |= 1;  // odd: it lies on a vertex of level 7, the center of an overlay
  vertex.j |= 1;
  after.SetOffsets({{vertex, Vec3(0, 0, 1)}});
  const Vec2 center = before.GrevillePoint(vertex);
  const double side_u = 1.0 / shape().PatchesU(kFinest - 1),
               side_v = 1.0 / shape().PatchesV(kFinest - 1);
  int touched = 0;
  for (int a = -30; a <= 30; ++a) {
    for (int b = -30; b <= 30; ++b) {
      const Vec2 step((a + 0.5) / 10, (b + 0.5) / 10);  // in patches of level 7
      const Vec2 uv = center + step.cwiseProduct(Vec2(side_u, side_v));
      const double moved = (after.Point(uv) - before.Point(uv)).norm();
      const bool inside = step.cwiseAbs().maxCoeff() < 1;
      EXPECT_EQ(moved > 0, inside) << step.transpose();
      touched += moved > 0;
    }
  }
  EXPECT_EQ(touched, 400);
}

TEST_P(DeepHSpline, IsC2AcrossTheBordersOfOverlays) {
  HSplineSurface surface = SmoothSurface(shape(), 4);
  const VertexId vertex = Near(kFinest, {0.4, 0.6});
  surface.SetOffsets({{vertex, Vec3(0.3, 0.2, 0.5)}});
  const double m = shape().PatchesU(kFinest), n = shape().PatchesV(kFinest), h = 1e-12;
  for (const DerivativeOrder order : {DerivativeOrder{}, {1, 0}, {0, 1}, {1, 1}, {2, 0}, {0, 2}}) {
    const double scale = std::pow(m, order.u) * std::pow(n, order.v);
    for (const double inside : {0.7, 1.9, 3.4}) {
      for (const int side : {-3, 1}) {  // the first and the last border of the 4 x 4 patches
        const double u = (vertex.i + side) / m, v = (vertex.j + side) / n,
                     across_u = (vertex.i - 3 + inside) / m, across_v = (vertex.j - 3 + inside) / n;
        EXPECT_LT((surface.Derivative({u - h, across_v}, order) -
                   surface.Derivative({u + h, across_v}, order))
                      .norm(),
                  1e-8 * scale);
        EXPECT_LT((surface.Derivative({across_u, v - h}, order) -
                   surface.Derivative({across_u, v + h}, order))
                      .norm(),
                  1e-8 * scale);
      }
    }
  }
}

TEST_P(DeepHSpline, MemoryGrowsWithTheEditsNotWithTheLevel) {
  HSplineSurface surface = SmoothSurface(shape(), 5);
  const std::size_t smooth = surface.Bytes();
  std::size_t before = smooth;
  const double columns = shape().Columns(kFinest), rows = shape().Rows(kFinest);
  for (int edit = 0; edit < 20; ++edit) {
    surface.SetOffsets({{{kFinest, edit * 37 + 20, (edit * 71) % 900 + 20}, Vec3(0, 0, 1)}});
    // The memory of at most 6 x 6 vertices per level, and of the spans of their columns.
    EXPECT_LT(surface.Bytes(), before + 8 * (36 * sizeof(Vec3) + 6 * 40) + 200 +
                                   (edit == 0 ? 2 * 2 * 4 * columns + 4000 : 0));
    before = surface.Bytes();
  }
  EXPECT_LT(100 * before, sizeof(Vec3) * columns * rows);
}

TEST_P(DeepHSpline, NetsAndPatchesHaveTheSameBytes) {
  HSplineShape shallow = shape();
  shallow.max_level = 4;
  const HSplineSurface surface = testing::RandomSurface(shallow, 6, 3);
  for (int level = 0; level <= 4; ++level) {
    const ControlNet net = surface.Net(level);
    for (int i = 0; i < shallow.PatchesU(level); ++i) {
      for (int j = 0; j < shallow.PatchesV(level); ++j) {
        const std::array<Vec3, 16> vertices = surface.PatchVertices({level, i, j});
        for (int k = 0; k < 16; ++k) {
          ASSERT_EQ(vertices[k], net.At(shallow.Column(level, i + k % 4), j + k / 4));
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, DeepHSpline,
    ::testing::Values(
        HSplineShape{.patches_u = 4, .patches_v = 5, .max_level = 8},
        HSplineShape{
            .patches_u = 5, .patches_v = 4, .max_level = 8, .closure = Closure::kPeriodicU},
        HSplineShape{
            .patches_u = 4, .patches_v = 4, .max_level = 8, .reference = OffsetReference::kWorld}));

}  // namespace
}  // namespace semblance::surfaces
