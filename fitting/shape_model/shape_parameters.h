// SPDX-License-Identifier: GPL-3.0-or-later
// The unknowns of a shape's estimate, and where they put a point of the model:
//   x = s R (mean + modes w + field a - centre) + t,  R = exp(omega) start_rotation.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "fitting/shape_model/shape_model.h"
#include "surfaces/base/geometry.h"

namespace semblance {

// What stays fixed: a pose near the solution, so that omega and t are well conditioned.
struct ShapeFrame {
  Mat3 start_rotation = Mat3::Identity();
  Vec3 centre = Vec3::Zero();  // of the model, mm
};

struct ShapeParameters {
  std::array<double, 7> pose = {};  // ln s, omega (3, rad), t (3, mm)
  Eigen::VectorXd coefficients;     // k, N(0,1)
  Eigen::VectorXd field;            // 3m, N(0,1): x, y, z of centre 0, of centre 1 ...

  Eigen::Index size() const { return 7 + coefficients.size() + field.size(); }
};

// The matrix that takes w to v x w.
Mat3 CrossMatrix(const Vec3& v);

// The parameters of the mean shape under a similarity.
ShapeParameters StartParameters(const ShapeFrame& frame, const Similarity& subject_from_model,
                                Eigen::Index modes, Eigen::Index centres);
// The frame in which omega starts at 0.
ShapeFrame StartFrame(const ShapeModel& model, const Similarity& subject_from_model);
Similarity SimilarityOf(const ShapeFrame& frame, const ShapeParameters& parameters);

// What the model says of one point.
struct ShapeRow {
  Vec3 mean = Vec3::Constant(kNaN);
  Eigen::Matrix3Xd modes;    // 3 x k
  Eigen::RowVectorXd field;  // m: the row of SmoothFieldFactor
};
// field: n x m, one row per point of the model.
ShapeRow RowAt(const ShapeModel& model, const Eigen::MatrixXd& field, const ModelPoint& at);
ShapeRow RowOfVertex(const ShapeModel& model, const Eigen::MatrixXd& field, int vertex);

// Derivatives of a placed point; empty matrices are not filled.
struct ShapeDerivatives {
  Eigen::Matrix<double, 3, 7> pose;
  Eigen::Matrix3d linear;  // of the unplaced point: s R; with it those by w and a follow
};
Vec3 PlacedPoint(const ShapeFrame& frame, const ShapeRow& row, std::span<const double> pose,
                 std::span<const double> coefficients, std::span<const double> field,
                 ShapeDerivatives* derivatives = nullptr);
Vec3 PlacedPoint(const ShapeFrame& frame, const ShapeRow& row, const ShapeParameters& parameters,
                 ShapeDerivatives* derivatives = nullptr);

// direction' d x / d (pose, w, a): 7 + k + 3m values.
Eigen::RowVectorXd DerivativeAlong(const Vec3& direction, const ShapeRow& row,
                                   const ShapeDerivatives& derivatives);

// All points of the model, placed.
std::vector<Vec3> PlacedPoints(const ShapeFrame& frame, const ShapeModel& model,
                               const Eigen::MatrixXd& field, const ShapeParameters& parameters);

}  // namespace semblance
