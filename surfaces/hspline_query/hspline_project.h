// SPDX-License-Identifier: GPL-3.0-or-later
// The closest point of an H-spline surface.
#pragma once

#include <vector>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

struct ProjectOptions {
  int samples_per_patch = 3;   // >= 1; along a side of a patch of the finest level with edits, of
                               // those with at most 65536 patches; more finds narrower valleys
  int starts = 4;              // >= 1; how many of the best valleys are descended into
  int max_iterations = 50;     // >= 1; of Newton's method, from each start
  double tolerance_mm = 1e-9;  // > 0; a step shorter than this has converged
};

struct SurfaceProjection {
  Vec2 uv = Vec2::Constant(kNaN);  // in [0,1] x [0,1]
  Vec3 point = Vec3::Constant(kNaN);
  double distance_mm = kNaN;
  int iterations = -1;  // of the descent that found it
  bool converged = false;
};

// Descends from `start` (clamped, or wrapped, into the domain) to a local minimum of the distance:
// Newton's method, Gauss-Newton's step where the distance is not convex, kept in the domain, with
// backtracking. For points that have moved little since they were last projected. Throws InputError
// for a point, start or option that cannot be used.
SurfaceProjection ProjectFrom(const HSplineSurface& surface, const Vec3& point, const Vec2& start,
                              const ProjectOptions& options = {});

// Projects many points onto one surface, of which it keeps a grid of samples: ProjectFrom starts at
// the samples that are nearer than their neighbours, and at the nearest of the patches that are
// finer than the grid; the closest result counts. The surface must outlive the projector, which
// does not see later changes.
class SurfaceProjector {
 public:
  explicit SurfaceProjector(const HSplineSurface& surface, const ProjectOptions& options = {});
  SurfaceProjection Project(const Vec3& point) const;

 private:
  std::vector<Vec2> Starts(const Vec3& point) const;

  const HSplineSurface& surface_;
  ProjectOptions options_;
  int quads_u_ = 0, quads_v_ = 0;  // of the grid
  int columns_ = 0, rows_ = 0;     // of its samples
  std::vector<Vec3> samples_;      // rows_ x columns_
  std::vector<Vec2> fine_uv_;      // the middles of patches finer than the grid
  std::vector<Vec3> fine_;
};

}  // namespace semblance
