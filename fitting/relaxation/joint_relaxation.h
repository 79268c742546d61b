// SPDX-License-Identifier: GPL-3.0-or-later
// A round of relaxation that moves (u,v) and control vertices in one problem.
#pragma once

#include <functional>
#include <span>

#include "fitting/level/level_fit.h"
#include "fitting/relaxation/relaxation.h"

namespace semblance {

// The level that is being fitted.
struct JointLevel {
  LevelView view;                          // of the target's points where they are
  std::span<const Term> terms;             // one of them at least `points` with a weight
  const HSplineSurface* detail = nullptr;  // whose levels finer than `level` the points see too
  int level = 0;                           // of the view
  std::function<double(const FitTarget&)> cost;  // of the terms, after a fit of the level to it
};

// The points' terms as functions of (u,v) and of the level's control vertices, the other terms, and
// the penalties of relaxation.h with each point's neighbours held, relative to the points' weight,
// in one ceres::Problem: Schur's complement eliminates the (u,v), a block of two for each corner of
// the mesh, and Levenberg-Marquardt takes a few steps, in which a point stays in its patch or
// little beyond. Then (u,v) move, each as far as no triangle turns over, and all less far, or not
// at all, until the terms, fitted there, and the penalties cost less than before. The vertices are
// the caller's to fit. Throws InputError without a term `points`.
RelaxationSummary RelaxJointly(const HSplineSurface& surface, const HSplineSurface& rest,
                               const DowelMesh& mesh, const NetworkMoves& moves,
                               const JointLevel& level, FitTarget& target);

}  // namespace semblance
