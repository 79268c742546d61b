// SPDX-License-Identifier: GPL-3.0-or-later
// Evaluates many points and normals of an H-spline at once.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "surfaces/hspline/patch_tree.h"

namespace semblance::surfaces {

struct SurfaceSamples {
  std::vector<Vec3> points;     // mm
  std::vector<Vec3> normals;    // unit, du x dv; zero where the tangents vanish or are parallel
  std::int64_t degenerate = 0;  // number of zero normals
};

// Stores one polynomial per leaf of the surface's PatchTree, so that memory grows with the detail
// and not with the finest level. Later changes of the surface have no effect.
class HSplineBatch {
 public:
  explicit HSplineBatch(const HSplineSurface& surface);

  // Evaluates one result per (u,v), with uv as in PatchPointAt. Equals HSplineSurface::Point and
  // Normal up to round-off. The result does not depend on `threads` (>= 1). Throws InputError for a
  // (u,v) that is not finite.
  std::vector<Vec3> Points(std::span<const Vec2> uv, int threads = 1) const;
  SurfaceSamples PointsAndNormals(std::span<const Vec2> uv, int threads = 1) const;
  // Writes the same to `samples` and reuses its memory.
  void PointsAndNormals(std::span<const Vec2> uv, int threads, SurfaceSamples& samples) const;

  std::size_t Bytes() const;  // memory in use

  // The surface on one patch in the power basis: S(s,t) = sum_{a,b} power[a + 4 b] s^a t^b, with s
  // and t in [0,1]. The columns of `power` are x, y, z and a zero.
  struct alignas(64) Polynomial {
    double power[16][4];
    double scale_u, scale_v;  // s = u * scale_u - first_u; the same for t
    double first_u, first_v;
  };

 private:
  void Sample(std::span<const Vec2> uv, int threads, Vec3* points, Vec3* normals,
              std::int64_t* degenerate) const;

  PatchTree tree_;
  std::vector<Polynomial> polynomials_;  // one per leaf
};

}  // namespace semblance::surfaces
