// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/bench_faces.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "surfaces/hspline_query/tessellate.h"
#include "tests/testing/splines.h"

namespace semblance::problems {
namespace {

using testing::RandomSurface;

const HSplineShape kShape{.patches_u = 6, .patches_v = 5, .max_level = 3};
constexpr int kPerPatch = 2;

// The largest distance of the pulled face's vertices from the prediction by moves of 1 mm, in mm.
double MaxPredictionError(const HSplineSurface& face, int level, const Vec3& by) {
  Pull pull{.level = level, .uv = {0.37, 0.61}};
  const auto moves = PullMoves(face, pull, kPerPatch);
  pull.by_mm = by;
  HSplineSurface pulled = face;
  ApplyEdits(Pulled(pull, face, {}), pulled);
  const std::vector<Vec3> before = Tessellate(face, kPerPatch).mesh.points;
  const std::vector<Vec3> after = Tessellate(pulled, kPerPatch).mesh.points;
  double farthest = 0;
  for (std::size_t v = 0; v < before.size(); ++v) {
    Vec3 predicted = before[v];
    for (int axis = 0; axis < 3; ++axis) {
      predicted += by[axis] * moves[axis][v];
    }
    farthest = std::max(farthest, (after[v] - predicted).norm());
  }
  return farthest;
}

TEST(PullMoves, AreExactIfNoFinerDetailTurns) {
  const HSplineSurface face = RandomSurface(kShape, 3);
  EXPECT_LT(MaxPredictionError(face, kShape.max_level, {10, -20, 5}), 1e-6);
}

TEST(PullMoves, HaveAnErrorThatVanishesWithThePullIfDetailTurns) {
  const HSplineSurface face = RandomSurface(kShape, 3);
  const Vec3 by(2, -4, 1);
  const double whole = MaxPredictionError(face, 1, by);
  const double tenth = MaxPredictionError(face, 1, 0.1 * by);
  EXPECT_GT(whole, 1e-3);
  EXPECT_LT(tenth, 0.2 * whole);
  EXPECT_LT(whole, 0.5 * by.norm());
}

}  // namespace
}  // namespace semblance::problems
