// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/shape_model/shape_parameters.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numeric>

namespace semblance {
namespace {

Mat3 RotationOf(const Vec3& omega) {
  const double angle = omega.norm();
  return angle == 0 ? Mat3(Mat3::Identity())
                    : Mat3(Eigen::AngleAxisd(angle, omega / angle).toRotationMatrix());
}

// exp(omega + d) = exp(J d) exp(omega) to first order in d (Chirikjian 2011, 10.86).
Mat3 LeftJacobian(const Vec3& omega) {
  const double angle = omega.norm();
  const Mat3 cross = CrossMatrix(omega);
  if (angle < 1e-6) {
    return Mat3::Identity() + cross / 2;
  }
  return Mat3::Identity() + (1 - std::cos(angle)) / (angle * angle) * cross +
         (angle - std::sin(angle)) / (angle * angle * angle) * cross * cross;
}

Vec3 MeanOf(const std::vector<Vec3>& points) {
  const Vec3 sum = std::accumulate(points.begin(), points.end(), Vec3(Vec3::Zero()));
  return sum / static_cast<double>(points.size());
}

std::span<const double> SpanOf(const Eigen::VectorXd& v) {
  return {v.data(), static_cast<std::size_t>(v.size())};
}

}  // namespace

Mat3 CrossMatrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

ShapeFrame StartFrame(const ShapeModel& model, const Similarity& subject_from_model) {
  return {subject_from_model.rotation, MeanOf(model.mean.points)};
}

ShapeParameters StartParameters(const ShapeFrame& frame, const Similarity& subject_from_model,
                                Eigen::Index modes, Eigen::Index centres) {
  ShapeParameters parameters;
  parameters.pose[0] = std::log(subject_from_model.scale);
  Vec3::Map(&parameters.pose[4]) = subject_from_model * frame.centre;
  parameters.coefficients = Eigen::VectorXd::Zero(modes);
  parameters.field = Eigen::VectorXd::Zero(3 * centres);
  return parameters;
}

Similarity SimilarityOf(const ShapeFrame& frame, const ShapeParameters& parameters) {
  Similarity similarity;
  similarity.scale = std::exp(parameters.pose[0]);
  similarity.rotation = RotationOf(Vec3::Map(&parameters.pose[1])) * frame.start_rotation;
  similarity.translation =
      Vec3::Map(&parameters.pose[4]) - similarity.scale * (similarity.rotation * frame.centre);
  return similarity;
}

ShapeRow RowOfVertex(const ShapeModel& model, const Eigen::MatrixXd& field, int vertex) {
  return {model.mean.points[vertex], model.modes.middleRows<3>(3 * Eigen::Index{vertex}),
          field.row(vertex)};
}

ShapeRow RowAt(const ShapeModel& model, const Eigen::MatrixXd& field, const ModelPoint& at) {
  ShapeRow row{Vec3::Zero(), Eigen::Matrix3Xd::Zero(3, model.Modes()),
               Eigen::RowVectorXd::Zero(field.cols())};
  for (int corner = 0; corner < 3; ++corner) {
    const int vertex = model.mean.triangles.at(at.triangle)[corner];
    row.mean += at.weights[corner] * model.mean.points[vertex];
    row.modes += at.weights[corner] * model.modes.middleRows<3>(3 * Eigen::Index{vertex});
    row.field += at.weights[corner] * field.row(vertex);
  }
  return row;
}

Vec3 PlacedPoint(const ShapeFrame& frame, const ShapeRow& row, std::span<const double> pose,
                 std::span<const double> coefficients, std::span<const double> field,
                 ShapeDerivatives* derivatives) {
  using ConstVector = Eigen::Map<const Eigen::VectorXd>;
  using ConstColumns = Eigen::Map<const Eigen::Matrix3Xd>;
  Vec3 local =
      row.mean - frame.centre + row.modes * ConstVector(coefficients.data(), row.modes.cols());
  if (row.field.size() > 0) {
    local += ConstColumns(field.data(), 3, row.field.size()) * row.field.transpose();
  }
  const Vec3 omega(pose[1], pose[2], pose[3]);
  const Mat3 linear = std::exp(pose[0]) * RotationOf(omega) * frame.start_rotation;
  const Vec3 arm = linear * local;
  if (derivatives != nullptr) {
    derivatives->pose.col(0) = arm;
    derivatives->pose.middleCols<3>(1) = -CrossMatrix(arm) * LeftJacobian(omega);
    derivatives->pose.rightCols<3>().setIdentity();
    derivatives->linear = linear;
  }
  return arm + Vec3(pose[4], pose[5], pose[6]);
}

Vec3 PlacedPoint(const ShapeFrame& frame, const ShapeRow& row, const ShapeParameters& parameters,
                 ShapeDerivatives* derivatives) {
  return PlacedPoint(frame, row, parameters.pose, SpanOf(parameters.coefficients),
                     SpanOf(parameters.field), derivatives);
}

Eigen::RowVectorXd DerivativeAlong(const Vec3& direction, const ShapeRow& row,
                                   const ShapeDerivatives& derivatives) {
  const Eigen::Index k = row.modes.cols(), m = row.field.size();
  const Eigen::RowVector3d linear = direction.transpose() * derivatives.linear;
  Eigen::RowVectorXd result(7 + k + 3 * m);
  result.head<7>() = direction.transpose() * derivatives.pose;
  result.segment(7, k) = linear * row.modes;
  Eigen::Map<Eigen::Matrix3Xd>(result.data() + 7 + k, 3, m) = linear.transpose() * row.field;
  return result;
}

std::vector<Vec3> PlacedPoints(const ShapeFrame& frame, const ShapeModel& model,
                               const Eigen::MatrixXd& field, const ShapeParameters& parameters) {
  const std::vector<Vec3> shape = ShapeAt(model, parameters.coefficients);
  Eigen::MatrixX3d field_moves = Eigen::MatrixX3d::Zero(field.rows(), 3);
  if (field.cols() > 0) {
    field_moves =
        field *
        Eigen::Map<const Eigen::Matrix3Xd>(parameters.field.data(), 3, field.cols()).transpose();
  }
  const Similarity similarity = SimilarityOf(frame, parameters);
  std::vector<Vec3> points;
  for (Eigen::Index v = 0; v < field.rows(); ++v) {
    points.push_back(similarity * (shape[v] + field_moves.row(v).transpose()));
  }
  return points;
}

}  // namespace semblance
