// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/pull.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
