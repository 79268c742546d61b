// SPDX-License-Identifier: GPL-3.0-or-later
// The face of `face: joint`: one ceres::Problem per step of the schedule, over control vertices,
// coefficients of the face model and pose.
#pragma once

#include "problems/experiment/make_face.h"
#include "problems/face/face_source.h"

namespace semblance::problems {

// Starts from the most likely face of the model. Each round seeds the implicit face below the
// surface and runs the schedule of fit.plan. In each step of it
//
//   - every dowel stands at the foot of its tip on the surface, to which it slid after the step
//     before. There the surface is drawn to the tip along its normal, tightly, and at the site's
//     own (u,v), which `sites` may state, across it, loosely. That is the parametric relaxation of
//     the dowels (docs/explanation/mathematics-fit.md). A dowel that `sites` holds does not slide;
//   - every seed draws the surface along the normal of the implicit face, with the standard
//     deviation that the implicit face has there. All seeds together are worth
//     estimate.surface_worth independent points;
//   - rules draw the model's points, as in the estimate of the start.
//
// Then SolveJointStep moves vertices, coefficients and pose by the step's fraction. Dowels, seeds
// and marks have Huber losses of the widths of `estimate`. `made.prior` has the model at the
// solution; its residuals and weights of tips and marks are those of the start.
//
// Random faces are drawn from JointPosterior at the end of the last step.
// Sigma (in.tells_sigma) is that of JointPosterior at the end of the last step, at the corners of
// the patches of its level. Two parts are added in squares, as by EstimateShape:
// 0.8 estimate.discrepancy_mm, because the deviation of the surface from the model expresses the
// rest, and unseen_rate (d - unseen_reach_mm) at the distance d from the nearest tip or seed.
// Throws InputError as FindLikelyFace does; Cancelled.
MadeFace MakeJointFace(const JointFace& options, PlacedTemplate placed, const FaceInput& in,
                       const RunContext& context);

}  // namespace semblance::problems
