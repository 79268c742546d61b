// SPDX-License-Identifier: GPL-3.0-or-later
// A round of relaxation that moves (u,v) and control vertices in one problem.
#pragma once

#include <functional>
#include <span>

#include "fitting/relaxation/dowel_mesh.h"
#include "fitting/relaxation/relaxation.h"
#include "fitting/solve/level_fit.h"

namespace semblance {

// The level that is being fitted.
struct JointLevel {
  LevelView view;                          // of the target's points where they are
  std::span<const Term> terms;             // one of them at least `points` with a weight
  const HSplineSurface* detail = nullptr;  // whose levels finer than `level` the points see too
  int level = 0;                           // of the view
  std::function<double(const FitTarget&)> cost;  // of the terms, after a fit of the level to it
};

// Moves (u,v) and the level's control vertices in one ceres::Problem: the points' terms as
// functions of both, the other terms, and the penalties of relaxation.h relative to the points'
// weight, with each point's neighbours held. The Schur complement eliminates the (u,v), one block
// of two per corner of the mesh. Levenberg-Marquardt takes a few steps, in which a point stays in
// its patch or little beyond it. Then each (u,v) moves as far as no triangle turns over. While the
// terms, fitted there, and the penalties do not cost less than before, all moves are halved, and at
// last dropped. The vertices are left for the caller to fit. Throws InputError without a term
// `points`.
RelaxationSummary RelaxJointly(const HSplineSurface& surface, const HSplineSurface& rest,
                               const DowelMesh& mesh, const NetworkMoves& moves,
                               const JointLevel& level, FitTarget& target);

}  // namespace semblance
