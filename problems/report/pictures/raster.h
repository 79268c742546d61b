// SPDX-License-Identifier: GPL-3.0-or-later
// Rasterisation: the samples of a grid that a triangle covers. Points are rounded to 1/256 sample
// and edges are tested in integers, so neighbouring triangles leave no holes and every machine
// gives the same result.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::problems {

inline constexpr std::int32_t kSubsamples = 256;  // steps per sample

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

// Barycentric coordinates in a triangle, sum 1.
struct Coverage {
  float a = 0, b = 0, c = 0;
  bool is_front = true;  // the corners run counter-clockwise in the picture
};

// Twice the signed area of the triangle p, q, (x, y), in steps.
template <class Int = std::int64_t>
Int Cross(const RasterPoint& p, const RasterPoint& q, Int x, Int y) {
  return (q.x - Int{p.x}) * (y - p.y) - (q.y - Int{p.y}) * (x - p.x);
}

// The coverage at the place (x, y), in steps, of a triangle with nonzero area.
inline Coverage CoverageAt(const RasterPoint& a, const RasterPoint& b, const RasterPoint& c,
                           std::int64_t x, std::int64_t y) {
  const std::int64_t area = Cross<std::int64_t>(a, b, c.x, c.y);
  const double scale = 1.0 / static_cast<double>(area);
  Coverage at{.is_front = area < 0};  // y runs down
  at.a = static_cast<float>(scale * static_cast<double>(Cross(b, c, x, y)));
  at.b = static_cast<float>(scale * static_cast<double>(Cross(c, a, x, y)));
  at.c = 1 - at.a - at.b;
  return at;
}

// Columns [x_begin, x_end), rows [y_begin, y_end).
struct SampleWindow {
  int x_begin = 0, x_end = 0, y_begin = 0, y_end = 0;
};

// Four neighbouring samples of a row.
using FourFloats = float __attribute__((vector_size(16)));
using FourInts = std::int32_t __attribute__((vector_size(16)));
using FourLongs = std::int64_t __attribute__((vector_size(32)));

// Visits the samples of the window, whose ends are included. The numbers of Lanes must hold twice
// the area of a triangle that is four samples larger.
template <class Lanes, class Visit>
void VisitFoursWith(const RasterPoint& a, const RasterPoint& b, const RasterPoint& c,
                    const SampleWindow& inclusive, Visit&& visit) {
  using Int = std::remove_cvref_t<decltype(Lanes{}[0])>;
  const Int area = Cross<Int>(a, b, c.x, c.y);
  if (area == 0) {
    return;
  }
  constexpr Int kSteps = kSubsamples, kHalf = kSteps / 2;
  const Int sign = area > 0 ? 1 : -1;
  const Int step_a = -sign * (c.y - Int{b.y}) * kSteps, step_b = -sign * (a.y - Int{c.y}) * kSteps;
  const float scale = 1 / static_cast<float>(sign * area);
  const float slope_b = scale * (b.depth - a.depth), slope_c = scale * (c.depth - a.depth);
  const Lanes ramp = {0, 1, 2, 3};
  const Int px = inclusive.x_begin * kSteps + kHalf;
  for (int y = inclusive.y_begin; y <= inclusive.y_end; ++y) {
    const Int py = y * kSteps + kHalf;
    Lanes ea = sign * Cross<Int>(b, c, px, py) + step_a * ramp;
    Lanes eb = sign * Cross<Int>(c, a, px, py) + step_b * ramp;
    for (int x = inclusive.x_begin; x <= inclusive.x_end; x += 4) {
      const Lanes ec = sign * area - ea - eb;
      const FourFloats depth = a.depth + slope_b * __builtin_convertvector(eb, FourFloats) +
                               slope_c * __builtin_convertvector(ec, FourFloats);
      visit(x, y, depth, __builtin_convertvector((ea | eb | ec) >= 0, FourInts));
      ea += 4 * step_a;
      eb += 4 * step_b;
    }
  }
}

// Calls visit(x, y, depth, inside) for groups of four samples from (x, y) to the right, row by row,
// which together hold every sample centre of the window that lies inside or on the edge of the
// triangle. `inside` is -1 at these and 0 at others. A group may reach beyond the window by up to
// three samples. A triangle without area covers nothing.
template <class Visit>
void VisitFours(const RasterPoint& a, const RasterPoint& b, const RasterPoint& c,
                const SampleWindow& window, Visit&& visit) {
  constexpr std::int32_t kHalf = kSubsamples / 2;
  const auto [left, right] = std::minmax({a.x, b.x, c.x});
  const auto [top, bottom] = std::minmax({a.y, b.y, c.y});
  const SampleWindow inclusive = {std::max(window.x_begin, (left + kHalf - 1) >> 8),
                                  std::min(window.x_end - 1, (right - kHalf) >> 8),
                                  std::max(window.y_begin, (top + kHalf - 1) >> 8),
                                  std::min(window.y_end - 1, (bottom - kHalf) >> 8)};
  if (inclusive.x_begin > inclusive.x_end || inclusive.y_begin > inclusive.y_end) {
    return;
  }
  // Triangles of up to 60 samples, which are nearly all, need half as wide numbers.
  constexpr std::int32_t kNarrow = 60 * kSubsamples;
  if (right - left <= kNarrow && bottom - top <= kNarrow) {
    VisitFoursWith<FourInts>(a, b, c, inclusive, visit);
  } else {
    VisitFoursWith<FourLongs>(a, b, c, inclusive, visit);
  }
}

// The depths of the nearest surfaces on a grid of samples, row by row.
struct DepthGrid {
  int columns = 0, rows = 0;
  int stride = 0;            // from row to row: a group of four may begin at the last column
  std::vector<float> depth;  // infinite where there is no surface

  DepthGrid() = default;
  DepthGrid(int columns_, int rows_)
      : columns(columns_),
        rows(rows_),
        stride(columns_ + 3),
        depth(static_cast<std::size_t>(stride) * rows_, std::numeric_limits<float>::infinity()) {}

  std::size_t Index(int x, int y) const { return static_cast<std::size_t>(y) * stride + x; }
};

// Takes `offered` where `inside` and nearer than `depth`, at four samples. Returns where it did.
inline FourInts TakeNearer(const FourFloats& offered, const FourInts& inside, float* depth) {
  FourFloats present;
  std::memcpy(&present, depth, sizeof(present));
  const FourInts nearer = inside & (offered < present);
  present = nearer ? offered : present;
  std::memcpy(depth, &present, sizeof(present));
  return nearer;
}

}  // namespace semblance::problems
