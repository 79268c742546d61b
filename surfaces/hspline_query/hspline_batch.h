// SPDX-License-Identifier: GPL-3.0-or-later
// Many points and normals of an H-spline at once.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/hspline/patch_tree.h"

namespace semblance {

struct SurfaceSamples {
  std::vector<Vec3> points;     // mm
  std::vector<Vec3> normals;    // unit, of du x dv; zero where the tangents vanish or are parallel
  std::int64_t degenerate = 0;  // how many normals are zero
};

// Keeps the polynomials of the surface's patches as they are now; it does not see later changes.
// Memory grows with the detail, not with the finest level.
class HSplineBatch {
 public:
  explicit HSplineBatch(const HSplineSurface& surface);

  // One per (u,v), which is clamped or wrapped as in StencilAt. Equal to HSplineSurface::Point and
  // Normal up to rounding; no byte depends on `threads` (>= 1). Throws InputError for a (u,v) that
  // is not finite.
  std::vector<Vec3> Points(std::span<const Vec2> uv, int threads = 1) const;
  SurfaceSamples PointsAndNormals(std::span<const Vec2> uv, int threads = 1) const;
  // The same into `samples`, reusing its memory.
  void PointsAndNormals(std::span<const Vec2> uv, int threads, SurfaceSamples& samples) const;

  std::size_t Bytes() const;  // of memory held

  // S(s,t) = sum of power[a + 4 b] s^a t^b, s and t in [0,1] on the patch; x, y, z and a zero.
  struct alignas(64) Polynomial {
    double power[16][4];
    double scale_u, scale_v;  // s = u * scale_u - first_u, t likewise
    double first_u, first_v;
  };

 private:
  void Sample(std::span<const Vec2> uv, int threads, Vec3* points, Vec3* normals,
              std::int64_t* degenerate) const;

  PatchTree tree_;
  std::vector<Polynomial> polynomials_;  // one per leaf
};

}  // namespace semblance
