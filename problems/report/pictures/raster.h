// SPDX-License-Identifier: GPL-3.0-or-later
// Rasterisation: the samples of a grid that a triangle covers. Points are rounded to 1/256 sample
// and edges are tested in integers, so neighbouring triangles leave no holes and every machine
// gives the same result.
#pragma once

#include <algorithm>
#include <cstdint>

#include "surfaces/base/geometry.h"

namespace semblance::problems {

inline constexpr std::int64_t kSubsamples = 256;  // steps per sample

struct RasterPoint {
  std::int32_t x = 0, y = 0;  // in steps; x right, y down
  float depth = 0;            // mm along the view, smaller is nearer
};

// An orthographic view of the world onto a sample grid.
struct Projection {
  Mat3 view_from_world = Mat3::Identity();  // rows: right, up, towards the viewer
  Vec3 centre = Vec3::Zero();               // at the middle of the grid, mm
  double samples_per_mm = 1;
  double width = 0, height = 0;  // of the grid, samples

  RasterPoint operator*(const Vec3& p) const {
    const Vec3 v = view_from_world * (p - centre);
    return {Steps(width / 2 + samples_per_mm * v.x()), Steps(height / 2 - samples_per_mm * v.y()),
            static_cast<float>(-v.z())};
  }

 private:
  // Clamps points far outside the grid (at 2^20 samples), so edge products stay within 64 bits.
  static std::int32_t Steps(double samples) {
    const double steps = std::clamp(samples * kSubsamples, -268435456.0, 268435456.0);
    return static_cast<std::int32_t>(steps + (steps < 0 ? -0.5 : 0.5));
  }
};

struct Coverage {
  int x = 0, y = 0;
  double a = 0, b = 0, c = 0;  // barycentric, sum 1
  float depth = 0;
  bool is_front = true;  // the corners run counter-clockwise in the picture
};

// Twice the signed area of the triangle p, q, (x, y), in steps.
inline std::int64_t Cross(const RasterPoint& p, const RasterPoint& q, std::int64_t x,
                          std::int64_t y) {
  return (q.x - std::int64_t{p.x}) * (y - p.y) - (q.y - std::int64_t{p.y}) * (x - p.x);
}

// The barycentric coordinates of the place (x, y), in steps, in a triangle with nonzero area. At
// the centre of a sample the result equals the Coverage that VisitSamples passes.
inline Coverage CoverageAt(const RasterPoint& a, const RasterPoint& b, const RasterPoint& c,
                           std::int64_t x, std::int64_t y) {
  const std::int64_t area = Cross(a, b, c.x, c.y), sign = area > 0 ? 1 : -1;
  const double scale = 1.0 / static_cast<double>(sign * area);
  Coverage at{.x = static_cast<int>(x / kSubsamples), .y = static_cast<int>(y / kSubsamples)};
  at.a = scale * static_cast<double>(sign * Cross(b, c, x, y));
  at.b = scale * static_cast<double>(sign * Cross(c, a, x, y));
  at.c = 1 - at.a - at.b;
  at.depth = static_cast<float>(at.a * a.depth + at.b * b.depth + at.c * c.depth);
  at.is_front = sign < 0;  // y runs down
  return at;
}

// Columns [x_begin, x_end), rows [y_begin, y_end).
struct SampleWindow {
  int x_begin = 0, x_end = 0, y_begin = 0, y_end = 0;
};

// Calls visit(Coverage), row by row, for each sample centre of the window that lies inside or on
// the edge of the triangle. A triangle without area covers nothing.
template <class Visit>
void VisitSamples(const RasterPoint& a, const RasterPoint& b, const RasterPoint& c,
                  const SampleWindow& window, Visit&& visit) {
  constexpr std::int64_t kHalf = kSubsamples / 2;
  const auto first = [](std::int64_t v) { return static_cast<int>((v + kHalf - 1) >> 8); };
  const auto last = [](std::int64_t v) { return static_cast<int>((v - kHalf) >> 8); };
  const int x0 = std::max(window.x_begin, first(std::min({a.x, b.x, c.x})));
  const int x1 = std::min(window.x_end - 1, last(std::max({a.x, b.x, c.x})));
  const int y0 = std::max(window.y_begin, first(std::min({a.y, b.y, c.y})));
  const int y1 = std::min(window.y_end - 1, last(std::max({a.y, b.y, c.y})));
  if (x0 > x1 || y0 > y1) {
    return;
  }
  const std::int64_t area = Cross(a, b, c.x, c.y);
  if (area == 0) {
    return;
  }
  const std::int64_t sign = area > 0 ? 1 : -1;
  const double scale = 1.0 / static_cast<double>(sign * area);
  const std::int64_t step_a = -sign * (c.y - std::int64_t{b.y}) * kSubsamples;
  const std::int64_t step_b = -sign * (a.y - std::int64_t{c.y}) * kSubsamples;
  const std::int64_t step_c = -step_a - step_b;
  for (int y = y0; y <= y1; ++y) {
    const std::int64_t px = x0 * kSubsamples + kHalf, py = y * kSubsamples + kHalf;
    std::int64_t ea = sign * Cross(b, c, px, py), eb = sign * Cross(c, a, px, py);
    std::int64_t ec = sign * area - ea - eb;
    for (int x = x0; x <= x1; ++x, ea += step_a, eb += step_b, ec += step_c) {
      if ((ea | eb | ec) >= 0) {
        const double wa = scale * static_cast<double>(ea), wb = scale * static_cast<double>(eb);
        const double wc = 1 - wa - wb;
        const auto depth = static_cast<float>(wa * a.depth + wb * b.depth + wc * c.depth);
        visit(Coverage{x, y, wa, wb, wc, depth, sign < 0});  // y runs down
      }
    }
  }
}

}  // namespace semblance::problems
