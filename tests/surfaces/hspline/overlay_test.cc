// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/overlay.h"

#include <gtest/gtest.h>

#include "tests/testing/splines.h"

namespace semblance {
namespace {

using testing::RandomSurface;

const HSplineShape kOpen{.patches_u = 5, .patches_v = 6, .max_level = 2};
const HSplineShape kTube{
    .patches_u = 5, .patches_v = 6, .max_level = 2, .closure = Closure::kPeriodicU};

Overlay Editable(const HSplineShape& shape, const Overlay& overlay) {
  Overlay editable;
  for (const VertexId& vertex : overlay) {
    if (IsEditable(shape, overlay, vertex)) {
      editable.insert(vertex);
    }
  }
  return editable;
}

// Whether all sixteen vertices of patch (p, q) of a level exist in the overlay.
bool CoversPatch(const HSplineShape& shape, const Overlay& overlay, int level, int p, int q) {
  for (int k = 0; k < 16; ++k) {
    if (!overlay.contains({level, (p + k % 4) % shape.Columns(level), q + k / 4})) {
      return false;
    }
  }
  return true;
}

TEST(Overlay, OnlyTheCentreOfALocalRefinementIsEditable) {
  for (const HSplineShape& shape : {kOpen, kTube}) {
    const Overlay overlay = LocalRefinement(shape, {1, 4, 5});
    EXPECT_EQ(overlay.size(), 49u);
    EXPECT_EQ(Editable(shape, overlay), (Overlay{{2, 7, 9}}));
  }
}

TEST(Overlay, NeighboursMergeAndTheVertexBetweenThemIsEditableToo) {
  Overlay overlay = LocalRefinement(kOpen, {1, 4, 5});
  overlay.merge(LocalRefinement(kOpen, {1, 5, 5}));
  EXPECT_EQ(Editable(kOpen, overlay), (Overlay{{2, 7, 9}, {2, 8, 9}, {2, 9, 9}}));
  Overlay apart = LocalRefinement(kOpen, {1, 4, 5});
  apart.merge(LocalRefinement(kOpen, {1, 8, 5}));
  EXPECT_EQ(Editable(kOpen, apart), (Overlay{{2, 7, 9}, {2, 15, 9}}));
}

TEST(Overlay, ALocalRefinementRedefinesExactlyTheFourPatchesAroundItsVertex) {
  for (const HSplineShape& shape : {kOpen, kTube}) {
    for (const auto& [i, j] : {std::pair(1, 1), {2, 3}, {5, 5}, {0, 4}}) {
      const Overlay overlay = LocalRefinement(shape, {0, i, j});
      for (int q = 0; q < shape.PatchesV(1); ++q) {
        for (int p = 0; p < shape.PatchesU(1); ++p) {
          // Vertex (i, j) lies on knot (i - 1, j - 1) of level 0.
          int du = p / 2 - (i - 1);
          if (shape.closure == Closure::kPeriodicU) {
            du = (du + 1 + 2 * shape.patches_u) % shape.patches_u - 1;
          }
          const int dv = q / 2 - (j - 1);
          const bool adjacent = du >= -1 && du <= 0 && dv >= -1 && dv <= 0;
          EXPECT_EQ(CoversPatch(shape, overlay, 1, p, q), adjacent) << i << " " << p << " " << q;
        }
      }
    }
  }
}

TEST(Overlay, EveryEditedVertexIsEditableInTheCompositeOverlay) {
  for (const HSplineShape& shape : {kOpen, kTube}) {
    const HSplineSurface surface = RandomSurface(shape, 4);
    for (int level = 1; level <= 2; ++level) {
      const Overlay overlay = CompositeOverlay(surface, level);
      EXPECT_FALSE(surface.Offsets(level).empty());
      for (const auto& [vertex, offset] : surface.Offsets(level)) {
        EXPECT_TRUE(IsEditable(shape, overlay, vertex)) << vertex.i << " " << vertex.j;
      }
    }
  }
}

TEST(Overlay, OutsideTheCompositeOverlayALevelIsTheCoarserSurface) {
  for (const HSplineShape& shape : {kOpen, kTube}) {
    const HSplineSurface surface = RandomSurface(shape, 5, 2);
    const Overlay overlay = CompositeOverlay(surface, 2);
    int outside = 0, moved_inside = 0;
    for (int q = 0; q < shape.PatchesV(2); ++q) {
      for (int p = 0; p < shape.PatchesU(2); ++p) {
        const Vec2 uv((p + 0.4) / shape.PatchesU(2), (q + 0.7) / shape.PatchesV(2));
        const Vec3 coarse = StencilAt(shape, 1, uv).Apply(surface.Net(1));
        const double moved = (surface.Point(uv) - coarse).norm();
        const bool covered = CoversPatch(shape, overlay, 2, p, q);
        EXPECT_TRUE(covered || moved < 1e-12 * 100) << p << " " << q;
        outside += !covered;
        moved_inside += covered && moved > 1e-6;
      }
    }
    EXPECT_GT(outside, 0);
    EXPECT_GT(moved_inside, 0);
  }
}

TEST(Overlay, ADenseLevelIsEditableEverywhereAndTheClippedSquareDoesAtBorders) {
  for (const HSplineShape& shape : {kOpen, kTube}) {
    Overlay all;
    for (int j = 0; j < shape.Rows(0); ++j) {
      for (int i = 0; i < shape.Columns(0); ++i) {
        all.merge(LocalRefinement(shape, {0, i, j}));
      }
    }
    EXPECT_EQ(all.size(), static_cast<std::size_t>(shape.Columns(1) * shape.Rows(1)));
    EXPECT_EQ(Editable(shape, all), all);
    all.erase(VertexId{1, 4, 4});
    EXPECT_FALSE(IsEditable(shape, all, {1, 1, 1}));
    EXPECT_TRUE(IsEditable(shape, all, {1, 8, 1}));
  }
}

}  // namespace
}  // namespace semblance
