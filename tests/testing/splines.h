// SPDX-License-Identifier: GPL-3.0-or-later
// H-spline surfaces for law tests, most of them random.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "surfaces/base/random.h"
#include "surfaces/hspline/hspline_surface.h"
#include "tests/testing/shapes.h"

namespace semblance::testing {
using namespace problems;

// A bent sheet (open), or a tube (closed in u).
inline Vec3 SmoothPlace(const HSplineShape& shape, double u, double v) {
  const double angle = (shape.ClosedU() ? 2 * std::numbers::pi : 2.0) * u;
  return {50 * std::cos(angle), 50 * std::sin(angle), 80 * v};
}

// Level 0 over such a shape, with small random changes and without edits.
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

// The same with `edits` random offsets per level above 0.
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

// The largest distance between points of equal (u,v), over a grid.
inline double LargestDistance(const HSplineSurface& a, const HSplineSurface& b,
                              const Similarity& a_from_b = {}) {
  double largest = 0;
  for (int k = 0; k <= 40 * 40; ++k) {
    const Vec2 uv(k % 41 / 40.0, k / 41 / 40.0);
    largest = std::max(largest, (a.Point(uv) - a_from_b * b.Point(uv)).norm());
  }
  return largest;
}

// The largest distance between corresponding vertices of two nets of one size.
inline double LargestMove(const ControlNet& a, const ControlNet& b) {
  double largest = 0;
  for (std::size_t k = 0; k < a.vertices.size(); ++k) {
    largest = std::max(largest, (a.vertices[k] - b.vertices[k]).norm());
  }
  return largest;
}

inline bool SameBytes(const ControlNet& a, const ControlNet& b) {
  return a.vertices.size() == b.vertices.size() &&
         std::memcmp(a.vertices.data(), b.vertices.data(), a.vertices.size() * sizeof(Vec3)) == 0;
}

// The `order`-th derivative (0..3) at x of the cubic B-spline with knots 0, 1, 2, 3, 4, from
// truncated powers: B(x) = sum_k (-1)^k C(4,k) (x - k)_+^3 / 6.
inline double CubicBSpline(double x, int order = 0) {
  if (x <= 0 || x >= 4) {
    return 0;
  }
  const double binomial[] = {1, -4, 6, -4, 1};
  const double factor[] = {1.0 / 6, 1.0 / 2, 1, 1};
  double sum = 0;
  for (int k = 0; k <= 4; ++k) {
    if (x > k) {
      sum += binomial[k] * factor[order] * std::pow(x - k, 3 - order);
    }
  }
  return sum;
}

// Weights of the sixteen vertices of an open net of m x n patches at (u,v) in [0,1]^2, for the
// derivative of orders (du, dv).
inline Stencil PlainStencil(int m, int n, const Vec2& uv, int du = 0, int dv = 0) {
  const double x = uv.x() * m, y = uv.y() * n;
  const int i = std::min(static_cast<int>(x), m - 1), j = std::min(static_cast<int>(y), n - 1);
  Stencil s;
  for (int k = 0; k < 16; ++k) {
    const int a = i + k % 4, b = j + k / 4;
    s.index[k] = a + (m + 3) * b;
    s.weight[k] = std::pow(m, du) * CubicBSpline(x - a + 3, du) * std::pow(n, dv) *
                  CubicBSpline(y - b + 3, dv);
  }
  return s;
}

}  // namespace semblance::testing
