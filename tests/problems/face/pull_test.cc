// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/pull.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "problems/face/template_face.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/splines.h"

namespace semblance::problems {
namespace {

using testing::RandomSurface;

const HSplineShape kPulledShape{.patches_u = 6, .patches_v = 5, .max_level = 3};

TEST(Pull, ThePointGoesWhereItIsPulledOnEveryLevel) {
  for (int level = 0; level <= 3; ++level) {
    const HSplineSurface before = RandomSurface(kPulledShape, 3);
    Pull pull{.level = level, .uv = {0.37, 0.61}, .by_mm = {1, -2, 0.5}};
    HSplineSurface after = before;
    ApplyEdits(Pulled(pull, before, {}), after);
    const Vec3 wanted = before.LevelDerivative(level, pull.uv) + pull.by_mm;
    EXPECT_LT((after.LevelDerivative(level, pull.uv) - wanted).norm(), 1e-9) << level;
  }
}

TEST(Pull, WhatLiesBeyondTheReachStays) {
  const HSplineSurface before = RandomSurface(kPulledShape, 4);
  HSplineSurface after = before;
  ApplyEdits(Pulled({.level = 2, .uv = {0.2, 0.2}, .by_mm = {0, 0, 5}, .reach = 2}, before, {}),
             after);
  // Two patches of reach, two of a vertex's own; of level 2 there are 24 x 20.
  for (const Vec2& far : {Vec2(0.5, 0.2), Vec2(0.2, 0.6), Vec2(0.9, 0.9)}) {
    EXPECT_EQ(after.Point(far), before.Point(far)) << far.transpose();
  }
}

TEST(Pull, ReachesAcrossTheSeamOfATube) {
  HSplineShape shape = kPulledShape;
  shape.closure = Closure::kPeriodicU;
  const HSplineSurface before = testing::SmoothSurface(shape, 4);
  HSplineSurface after = before;
  ApplyEdits(Pulled({.level = 2, .uv = {0.01, 0.5}, .by_mm = {0, 0, 5}, .reach = 2}, before, {}),
             after);
  EXPECT_GT((after.Point({0.99, 0.5}) - before.Point({0.99, 0.5})).norm(), 2);
  EXPECT_EQ(after.Point({0.5, 0.5}), before.Point({0.5, 0.5}));
}

TEST(Pull, ManyPullsAreOneScriptThatReplaysOnTheSurfaceBefore) {
  const HSplineSurface before = RandomSurface(kPulledShape, 5);
  HSplineSurface now = before;
  EditScript script;
  Random random(7);
  for (int k = 0; k < 12; ++k) {
    const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
    const Vec3 last = random.InBox(-2, 2);
    script = Pulled({.level = k % 4, .uv = uv, .by_mm = last}, now, script);
    const Vec3 wanted = now.LevelDerivative(k % 4, uv) + last;
    now = before;
    ApplyEdits(script, now);
    EXPECT_LT((now.LevelDerivative(k % 4, uv) - wanted).norm(), 1e-6) << k;
  }
}

TEST(Pull, MirroredBothSidesMoveAlike) {
  const HSplineSurface before = MakeTemplateFace({}).surface;
  for (const double u : {0.5, 0.52, 0.6, 0.75}) {
    const Pull pull{.level = 2, .uv = {u, 0.45}, .by_mm = {2, -3, 1}, .mirror = true};
    HSplineSurface after = before;
    ApplyEdits(Pulled(pull, before, {}), after);
    for (double v = 0.3; v < 0.7; v += 0.05) {
      for (double w = 0.5; w < 1; w += 0.05) {
        Vec3 other = after.Point({1 - w, v});
        other.x() = -other.x();
        EXPECT_LT((after.Point({w, v}) - other).norm(), 1e-6) << u << " " << w << " " << v;
      }
    }
    const Vec3 moved = after.LevelDerivative(2, pull.uv) - before.LevelDerivative(2, pull.uv);
    EXPECT_NEAR(moved.y(), -3, 1e-9) << u;
    EXPECT_NEAR(moved.z(), 1, 1e-9) << u;
    if (u != 0.52) {  // near the midline the sides hold each other
      EXPECT_NEAR(moved.x(), u > 0.5 ? 2 : 0, 1e-6) << u;
    }
  }
}

TEST(Pull, LeftIsTheSubjectsLeft) {
  EXPECT_LT((FindLeft(MakeTemplateFace({}).surface) - Vec3(1, 0, 0)).norm(), 1e-6);
}

HSplineSurface AfterBrush(const Brush& brush, const HSplineSurface& face) {
  HSplineSurface after = face;
  ApplyEdits(Brushed(brush, face, {}), after);
  return after;
}

TEST(Brush, InflatesAlongTheNormalByItsStrength) {
  const HSplineSurface before = MakeTemplateFace({}).surface;
  const Vec2 uv(0.62, 0.45);
  for (const double mm : {2.0, -2.0}) {
    const HSplineSurface after = AfterBrush(
        {.kind = BrushKind::kInflate, .level = 0, .uv = uv, .strength = mm, .reach = 8}, before);
    const double moved = (after.Point(uv) - before.Point(uv)).dot(before.Normal(uv)) / mm;
    EXPECT_GT(moved, 0.5);
    EXPECT_LE(moved, 1 + 1e-9);
  }
}

TEST(Brush, SmoothingShortensTheDistanceFromTheNeighbours) {
  HSplineSurface before = RandomSurface(kPulledShape, 8);
  ControlNet rough = before.Net(2);
  for (std::size_t k = 0; k < rough.vertices.size(); ++k) {
    rough.vertices[k].z() += k % 2 == 0 ? 1 : -1;
  }
  before.SetNet(2, rough);
  const auto roughness = [](const HSplineSurface& face) {
    const ControlNet net = face.Net(2);
    double sum = 0;
    for (int j = 8; j < 14; ++j) {
      for (int i = 10; i < 16; ++i) {
        sum += (net.At(i - 1, j) + net.At(i + 1, j) + net.At(i, j - 1) + net.At(i, j + 1) -
                4 * net.At(i, j))
                   .squaredNorm();
      }
    }
    return sum;
  };
  const HSplineSurface after =
      AfterBrush({.level = 2, .uv = {0.5, 0.5}, .strength = 0.5, .reach = 4}, before);
  EXPECT_LT(roughness(after), 0.7 * roughness(before));
}

TEST(Brush, FlatteningBringsVerticesToTheTangentPlane) {
  const HSplineSurface before = MakeTemplateFace({}).surface;
  const Vec2 uv(0.6, 0.5);
  const HSplineSurface after = AfterBrush(
      {.kind = BrushKind::kFlatten, .level = 2, .uv = uv, .strength = 1, .reach = 8}, before);
  const Vec3 point = before.Point(uv), normal = before.Normal(uv);
  for (const Vec2& beside : {Vec2(0.68, 0.5), Vec2(0.54, 0.55), Vec2(0.6, 0.42)}) {
    EXPECT_LT(std::abs((after.Point(beside) - point).dot(normal)),
              0.6 * std::abs((before.Point(beside) - point).dot(normal)));
  }
}

TEST(Brush, WithoutStrengthChangesNothingAndBeyondItsRangeIsRefused) {
  const HSplineSurface face = RandomSurface(kPulledShape, 6);
  const Vec2 uv(0.4, 0.5);
  for (const BrushKind kind : {BrushKind::kSmooth, BrushKind::kInflate, BrushKind::kFlatten}) {
    const HSplineSurface same = AfterBrush({.kind = kind, .uv = uv, .strength = 0}, face);
    EXPECT_EQ(same.Point(uv), face.Point(uv));
    EXPECT_THROW(Brushed({.kind = kind, .uv = uv, .strength = 21}, face, {}), InputError);
    EXPECT_THROW(Brushed({.kind = kind, .uv = uv}, face, {}), InputError);
  }
  EXPECT_THROW(Brushed({.uv = uv, .strength = -0.1}, face, {}), InputError);
}

TEST(Pull, WhatCannotBeIsRefused) {
  const HSplineSurface face = RandomSurface(kPulledShape, 6);
  const Vec2 uv(0.5, 0.5);
  EXPECT_THROW(Pulled({.level = 4, .uv = uv, .by_mm = {1, 0, 0}}, face, {}), InputError);
  EXPECT_THROW(Pulled({.level = 1, .uv = uv, .by_mm = {kNaN, 0, 0}}, face, {}), InputError);
  EXPECT_THROW(Pulled({.level = 1, .uv = uv, .by_mm = {1, 0, 0}, .reach = 0.5}, face, {}),
               InputError);
}

}  // namespace
}  // namespace semblance::problems
