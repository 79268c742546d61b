// SPDX-License-Identifier: GPL-3.0-or-later
// One step of a fit in which the control vertices of a level, the coefficients of a face model and
// the pose are unknowns of one ceres::Problem. The face model is not a face computed beforehand:
// what dowels and implicit face do to the surface moves the model too.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <string>
#include <vector>

#include "fitting/problem/fit_schedule.h"
#include "fitting/solve/level_summary.h"
#include "problems/face/hspline_prior.h"
#include "problems/face/residual_field.h"
#include "problems/face/shape_model/shape_posterior.h"
#include "surfaces/hspline/bspline.h"
#include "surfaces/hspline/hspline_shape.h"

namespace semblance::problems {

// The control vertices of the finest level as points of a shape model. A B-spline commutes with
// affine maps, so the vertices of the model's surface are placed like its points:
//   model_i(pose, w, a) = s R (mean_i + modes_i w + field_i a - centre) + t.
struct VertexModel {
  HSplineShape shape;
  std::vector<ShapeRow> rows;  // one per vertex of shape.max_level

  // The row of the surface's point at (u,v): a weighted sum of sixteen vertices' rows.
  ShapeRow RowAt(const Vec2& uv) const;
};

// The least-squares nets of the mean, of each mode and of each column of the field. field: one row
// per point of the model (SmoothFieldFactor). Throws InputError for a surface that is not open.
VertexModel MakeVertexModel(const FacePrior& prior, const PriorOnTemplate& on_template,
                            const Eigen::MatrixXd& field, const HSplineShape& shape);

// An observation of the surface S at (u,v). Its cost is
// weight * Huber_width(|whitening (S(u,v) - position)|^2), as that of a ShapeObservation.
struct SurfaceObservation {
  Vec2 uv = Vec2::Constant(kNaN);
  Vec3 position = Vec3::Constant(kNaN);  // mm
  Eigen::Matrix<double, Eigen::Dynamic, 3> whitening;
  double loss_width = kNaN;
  double weight = 1;
  // For JointPosterior, as in ShapeObservation: a shared error, and an error like the neighbours'.
  Vec3 shared_mm = Vec3::Zero();
  double smooth_sd_mm = 0;
};

struct JointData {
  std::vector<SurfaceObservation> dowels;
  std::vector<SurfaceObservation> seeds;
  std::vector<ShapeObservation> marks;  // of the model's points; for rules
};

struct JointWeights {
  ResidualFieldOptions residual;
  ShapePrior prior;
  ShapePose start_pose = kUprightPose;  // mean of the pose's prior
};

// The face between two steps: S(u,v) = model(u,v; pose, w, a) + R(u,v). R is the deviation from the
// model, a hierarchical B-spline of its own. residual[l] is its net with the detail of levels 0..l;
// the last one is R.
struct JointState {
  std::vector<ControlNet> residual;  // per level 0..max_level, mm
  ShapeFrame frame;
  ShapeParameters parameters;

  Vec3 Point(const VertexModel& model, const Vec2& uv) const;
};

// The model's own face: no deviation.
JointState StartJoint(const HSplineShape& shape, const ShapeFrame& frame,
                      const ShapeParameters& parameters);

// Adds `move` to R's vertices of the level; the nets of finer levels move along with it.
void MoveDeviation(const HSplineShape& shape, int level, ControlNet move, JointState& state);

// The Jacobian of a step's problem at `state`, part by part, times the roots of weights and losses.
// Columns: a step of the pose (7), coefficients, field, then x, y and z of each vertex of
// residual[level]. Rows: those of the observations in their order, of MakeFieldRows (three each),
// and one per parameter of the model. Throws InputError for a level that the model does not have.
struct JointRows {
  Eigen::SparseMatrix<double> dowels, seeds, marks, residual_field, face_model;
};
JointRows LinearizeJointStep(const VertexModel& model, const JointData& data,
                             const JointWeights& weights, int level, const JointState& state);

// A step ends when an iteration lowers the cost by less than this part of it. Rotation and losses
// are not linear, so steps converge linearly. With 1e-7 they take twice as many iterations, which
// moves the face of the Visible Human Male by 0.003 mm on average and by 0.013 mm at most; and the
// next step starts again.
inline constexpr double kStepTolerance = 1e-5;

// Solves one step and moves the vertices of its level and the parameters by its fraction of the way
// to the solution. The solution makes least, over the vertices r_i of residual[level], the pose,
// and the coefficients w and a,
//   dowels + seeds + marks + sum over rows of MakeFieldRows |row r|^2
//     + |w / mode_sd|^2 + |a|^2 + the prior of the pose.
// The face's control vertices are model_i + r_i. To solve for r_i instead of them changes nothing
// but the speed: no row then couples a vertex with all coefficients, except at the data. Finer
// levels of R keep their detail, which moves along. `terms` of the summary are dowels, seeds,
// marks, residual_field and face_model, without those that have no data; their values are the costs
// above. Its moves are those of R. One thread; the same input gives the same bytes. Throws
// InputError for a level that the model does not have.
LevelSummary SolveJointStep(const VertexModel& model, const JointData& data,
                            const JointWeights& weights, const ScheduleStep& step,
                            JointState& state, double function_tolerance = kStepTolerance);

}  // namespace semblance::problems
