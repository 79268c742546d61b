// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the closest point of an H-spline surface.
#pragma once

#include <vector>

#include "surfaces/hspline/hspline_surface.h"

namespace semblance::surfaces {

struct ProjectOptions {
  int samples_per_patch = 3;   // >= 1; start samples along a patch side; more find narrower valleys
  int starts = 4;              // >= 1; number of best valleys to descend into
  int max_iterations = 50;     // >= 1; Newton steps per start
  double tolerance_mm = 1e-9;  // > 0; a descent has converged once its step is shorter
};

struct SurfaceProjection {
  Vec2 uv = Vec2::Constant(kNaN);  // in [0,1] x [0,1]
  Vec3 point = Vec3::Constant(kNaN);
  double distance_mm = kNaN;
  int iterations = -1;  // of the successful descent
  bool converged = false;
};

// Descends from `start` (brought into the domain) to a local minimum of the distance. It uses
// Newton's method, or Gauss-Newton steps where the distance is not convex, with backtracking,
// within the domain. Use it for points that moved little since their last projection. Throws
// InputError for a point, start or option that is not valid.
SurfaceProjection ProjectFrom(const HSplineSurface& surface, const Vec3& point, const Vec2& start,
                              const ProjectOptions& options = {});

// Projects many points onto one surface. It keeps a grid of samples on the finest level with edits
// that has at most 65536 patches. ProjectFrom starts at the samples that are nearer than their
// neighbours, and at the nearest patch that is finer than the grid; the closest result is returned.
// The surface must outlive the projector and must not change.
class SurfaceProjector {
 public:
  explicit SurfaceProjector(const HSplineSurface& surface, const ProjectOptions& options = {});
  SurfaceProjection Project(const Vec3& point) const;

 private:
  std::vector<Vec2> Starts(const Vec3& point) const;

  const HSplineSurface& surface_;
  ProjectOptions options_;
  int quads_u_ = 0, quads_v_ = 0;  // of the grid of samples
  int columns_ = 0, rows_ = 0;     // number of samples
  std::vector<Vec3> samples_;      // rows_ x columns_
  std::vector<Vec2> fine_uv_;      // centers of patches finer than the grid
  std::vector<Vec3> fine_;
};

}  // namespace semblance::surfaces
