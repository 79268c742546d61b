// SPDX-License-Identifier: GPL-3.0-or-later
// An uniform bicubic B-spline written down from its definition, as an oracle.
#pragma once

#include <cmath>

#include "surfaces/hspline/bspline.h"

namespace semblance::testing {

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
