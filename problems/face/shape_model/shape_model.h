// SPDX-License-Identifier: GPL-3.0-or-later
// A statistical model of a shape: a mean mesh, and the modes in which the shapes of a population
// differ from it (Cootes et al. 1995; Blanz & Vetter 1999). The unknowns of a shape's estimate
// place a point of the model at
//
//   x = s R (mean + modes w + field a - centre) + t
//
// with the pose (s, R, t), the coefficients w of the modes and a of the smooth field.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string_view>
#include <vector>

#include "problems/face/shape_model/shape_pose.h"
#include "surfaces/base/geometry.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

struct ShapeModel {
  TriMesh mean;           // n points, mm; triangles face outward
  Eigen::MatrixXd modes;  // 3n x k, mm per coefficient; rows 3v .. 3v+2 are x, y, z of point v

  Eigen::Index Modes() const { return modes.cols(); }
};

// A point on the model's mesh: a weighted sum of the corners of a triangle.
struct ModelPoint {
  int triangle = -1;
  Vec3 weights = Vec3::Constant(kNaN);  // sum 1
};

// Throws InputError, with a message that starts with `name`, if the model has no triangle or no
// mode, if the modes do not have three rows per point, if a corner is not a point, or if a value is
// not finite.
void CheckShapeModel(const ShapeModel& model, std::string_view name);

// The points mean + modes * coefficients of a shape. Over the population the coefficients are
// independent N(0,1). Throws InputError if there is not one per mode.
std::vector<Vec3> ShapeAt(const ShapeModel& model, const Eigen::VectorXd& coefficients);

// The position of a model point on a shape. points: one per point of the mean.
Vec3 FindPosition(const ModelPoint& at, const TriMesh& mean, const std::vector<Vec3>& points);

// The fixed part of the placement: the point of the model that t places. At its centre, a turn and
// a shift are nearly independent.
struct ShapeFrame {
  Vec3 centre = Vec3::Zero();  // mm
};

struct ShapeParameters {
  ShapePose pose = kUprightPose;
  Eigen::VectorXd coefficients;  // k, N(0,1)
  Eigen::VectorXd field;         // 3m, N(0,1): x, y, z of centre 0, of centre 1 ...

  // The unknowns: those of a step of the pose, then coefficients and field.
  Eigen::Index size() const { return 7 + coefficients.size() + field.size(); }
};

// step: size() unknowns.
ShapeParameters MoveParameters(const ShapeParameters& from, const Eigen::VectorXd& step);
// from + fraction (to - from); the pose turns that part of the way.
ShapeParameters PartOfWay(const ShapeParameters& from, const ShapeParameters& to, double fraction);

// The parameters of the mean shape under a similarity.
ShapeParameters StartParameters(const ShapeFrame& frame, const Similarity& subject_from_model,
                                Eigen::Index modes, Eigen::Index centres);
// The centre of the mean's points.
ShapeFrame CentredFrame(const ShapeModel& model);
// subject_from_model at these parameters.
Similarity MakeSimilarity(const ShapeFrame& frame, const ShapeParameters& parameters);

// The model's rows for one point.
struct ShapeRow {
  Vec3 mean = Vec3::Constant(kNaN);
  Eigen::Matrix3Xd modes;    // 3 x k
  Eigen::RowVectorXd field;  // m: the row of SmoothFieldFactor
};
// field: n x m, one row per point of the model.
ShapeRow PointRowAt(const ShapeModel& model, const Eigen::MatrixXd& field, const ModelPoint& at);
ShapeRow VertexRow(const ShapeModel& model, const Eigen::MatrixXd& field, int vertex);
// The row of the mean of some points, of one at least.
ShapeRow MeanRow(const ShapeModel& model, const Eigen::MatrixXd& field,
                 const std::vector<ModelPoint>& at);

// Derivatives of a placed point. The derivatives by w and a follow from `linear`.
struct ShapeDerivatives {
  Eigen::Matrix<double, 3, 7> pose;  // by a step of the pose, at 0
  Eigen::Matrix3d linear;            // by the unplaced point: s R
};
Vec3 PlacedPoint(const ShapeFrame& frame, const ShapeRow& row, std::span<const double> pose,
                 std::span<const double> coefficients, std::span<const double> field,
                 ShapeDerivatives* derivatives = nullptr);
Vec3 PlacedPoint(const ShapeFrame& frame, const ShapeRow& row, const ShapeParameters& parameters,
                 ShapeDerivatives* derivatives = nullptr);

// The derivatives direction' dx / d(pose, w, a): 7 + k + 3m values.
Eigen::RowVectorXd DerivativeAlong(const Vec3& direction, const ShapeRow& row,
                                   const ShapeDerivatives& derivatives);

// The placed positions of all points of the model.
std::vector<Vec3> PlacedPoints(const ShapeFrame& frame, const ShapeModel& model,
                               const Eigen::MatrixXd& field, const ShapeParameters& parameters);

}  // namespace semblance::problems
