// SPDX-License-Identifier: GPL-3.0-or-later
// A small joint fit, and the covariance of its deviations from the model by dense matrices.
#pragma once

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "problems/face/joint_fit.h"
#include "surfaces/base/random.h"
#include "surfaces/hspline/bspline.h"

namespace semblance::testing {

using problems::FieldRow;
using problems::JointData;
using problems::JointState;
using problems::JointWeights;
using problems::ShapeFrame;
using problems::ShapeRow;
using problems::SurfaceObservation;
using problems::VertexModel;

inline constexpr int kModeCount = 3, kCentreCount = 2, kTipCount = 6;
inline const Vec3 kModelShift(3, -2, 1);  // of the model at the start, mm

inline Vec3 AnyVector(Random& random, double size) { return size * random.InBox(-1, 1); }

// A flat net with random modes and a random field, and observations near it.
struct JointCase {
  VertexModel model;
  JointData data;
  JointWeights weights;
  JointState state;

  explicit JointCase(std::uint64_t random_seed, int max_level = 0)
      : model{.shape = {.patches_u = 4, .patches_v = 3, .max_level = max_level}, .rows = {}} {
    Random random(random_seed);
    const HSplineShape& shape = model.shape;
    const double du = 15.0 / (1 << max_level), dv = 17.0 / (1 << max_level);
    for (int k = 0; k < shape.Columns(max_level) * shape.Rows(max_level); ++k) {
      const int columns = shape.Columns(max_level);
      ShapeRow row{Vec3(du * (k % columns), dv * (k / columns), 0), Eigen::Matrix3Xd(3, kModeCount),
                   Eigen::RowVectorXd(kCentreCount)};
      for (int mode = 0; mode < kModeCount; ++mode) {
        row.modes.col(mode) = AnyVector(random, 4);
      }
      for (int m = 0; m < kCentreCount; ++m) {
        row.field[m] = random.Uniform(-2, 2);
      }
      model.rows.push_back(row);
    }
    const ShapeFrame frame{.centre = Vec3(50, 40, 0)};
    const Similarity start{1, Mat3::Identity(), kModelShift};
    state = problems::StartJoint(shape, frame,
                                 problems::StartParameters(frame, start, kModeCount, kCentreCount));
    weights.start_pose = state.parameters.pose;
    for (int n = 0; n < kTipCount; ++n) {
      const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
      const Eigen::Matrix3d any =
          Eigen::Matrix3d::NullaryExpr([&] { return random.Uniform(-1, 1); });
      data.dowels.push_back({.uv = uv,
                             .position = Point(uv) - kModelShift + AnyVector(random, 6),
                             .whitening = any + 2 * Eigen::Matrix3d::Identity(),
                             .loss_width = 1e9});
    }
  }

  Vec3 Point(const Vec2& uv) const { return state.Point(model, uv); }

  // The weights of the vertices in each observed point.
  Eigen::MatrixXd Basis() const {
    const std::vector<SurfaceObservation>& seen = data.dowels;
    Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(std::ssize(seen), std::ssize(model.rows));
    for (std::size_t n = 0; n < seen.size(); ++n) {
      const Stencil stencil = StencilAt(model.shape, 0, seen[n].uv);
      for (int k = 0; k < 16; ++k) {
        basis(n, stencil.index[k]) += stencil.weight[k];
      }
    }
    return basis;
  }
};

// The covariance of the vertices' deviations along one axis: the inverse of the rows' moments.
inline Eigen::MatrixXd DeviationCovariance(const JointCase& c) {
  // The surface is flat and starts on the model's mean, whose vertices have even distances.
  ControlNet places = c.state.residual[0];
  for (int k = 0; k < places.columns * places.rows; ++k) {
    places.vertices[k] = c.model.rows[k].mean;
  }
  const std::vector<FieldRow> rows = problems::MakeFieldRows(places, c.weights.residual);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(std::ssize(rows), std::ssize(rows));
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t k = 0; k < rows[r].index.size(); ++k) {
      dense(r, rows[r].index[k]) += rows[r].weight[k];
    }
  }
  return (dense.transpose() * dense).inverse();
}

}  // namespace semblance::testing
