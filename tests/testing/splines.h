// SPDX-License-Identifier: GPL-3.0-or-later
// H-spline surfaces for law tests, most of them random.
#pragma once

#include <cmath>
#include <numbers>

#include "surfaces/base/random.h"
#include "surfaces/hspline/hspline_surface.h"
#include "tests/testing/shapes.h"

namespace semblance::testing {

// A bent sheet (open) or a tube (closed in u).
inline Vec3 SmoothPlace(const HSplineShape& shape, double u, double v) {
  const double angle = (shape.ClosedU() ? 2 * std::numbers::pi : 2.0) * u;
  return {50 * std::cos(angle), 50 * std::sin(angle), 80 * v};
}

// Level 0 over that, shaken a little; no edits yet.
inline HSplineSurface SmoothSurface(const HSplineShape& shape, std::uint64_t random_seed) {
  Random random(random_seed);
  ControlNet net{shape.Columns(0), shape.Rows(0), {}};
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      const double u = (i - 1.0) / shape.patches_u, v = (j - 1.0) / shape.patches_v;
      net.vertices.push_back(SmoothPlace(shape, u, v) + random.InBox(-1, 1));
    }
  }
  return HSplineSurface(shape, net);
}

// The same with `edits` random offsets on each level above 0.
inline HSplineSurface RandomSurface(const HSplineShape& shape, std::uint64_t random_seed,
                                    int edits = 12) {
  HSplineSurface surface = SmoothSurface(shape, random_seed);
  Random random(random_seed + 1000);
  for (int level = 1; level <= shape.max_level; ++level) {
    std::map<VertexId, std::optional<Vec3>> offsets;
    for (int e = 0; e < edits; ++e) {
      const int i = static_cast<int>(random.Uniform(0, shape.Columns(level)));
      const int j = static_cast<int>(random.Uniform(0, shape.Rows(level)));
      offsets[{level, i, j}] = random.InBox(-1, 1);
    }
    surface.SetOffsets(offsets);
  }
  return surface;
}

}  // namespace semblance::testing
