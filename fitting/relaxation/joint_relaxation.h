// SPDX-License-Identifier: GPL-3.0-or-later
// One round of the joint relaxation, which moves (u,v) and control vertices in one problem.
#pragma once

#include <functional>
#include <span>

#include "fitting/relaxation/dowel_mesh.h"
#include "fitting/relaxation/relaxation.h"
#include "fitting/solve/space_solve.h"

namespace semblance::fitting {

// The level of the fit.
struct JointLevel {
  LevelView view;               // of the target's points at their present (u,v)
  std::span<const Term> terms;  // at least one `points` with a positive weight
  // The surface whose levels finer than `level` are added to the view's surface; null: none.
  const HSplineSurface* detail = nullptr;
  int level = 0;
  std::function<double(const FitTarget&)> cost;  // fits the level, and returns the terms' cost
};

// Moves (u,v) and the level's control vertices in one ceres::Problem. Its residuals are the points'
// terms as functions of both, the other terms, and the penalties of relaxation.h with each point's
// neighbours fixed, relative to the points' weight. The Schur complement eliminates the (u,v), one
// block of two per corner of the mesh. Levenberg-Marquardt takes a few steps, which keep a point
// within its patch or slightly beyond.
//
// The moves of (u,v) are then shortened until no triangle turns over (with the barrier). All moves
// are halved, and at last dropped, while the cost of the terms (after a fit) and the penalties is
// not below that before. The vertices are left for the caller to fit. Throws InputError without a
// term `points`.
RelaxationSummary RelaxJointly(const HSplineSurface& surface, const HSplineSurface& rest,
                               const DowelMesh& mesh, const NetworkMoves& moves,
                               const JointLevel& level, FitTarget& target);

}  // namespace semblance::fitting
