// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/shape_model/shape_model.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

[[noreturn]] void Fail(std::string_view name, const std::string& what) {
  throw InputError(fmt::format("{}: {}", name, what));
}

bool AreCorners(const Triangle& t, std::size_t points) {
  return std::ranges::all_of(
      t, [&](std::int32_t v) { return v >= 0 && static_cast<std::size_t>(v) < points; });
}

}  // namespace

void CheckShapeModel(const ShapeModel& model, std::string_view name) {
  const std::size_t points = model.mean.points.size();
  if (model.mean.triangles.empty() || model.Modes() == 0) {
    Fail(name, fmt::format("a shape model needs triangles and modes; this one has {} and {}",
                           model.mean.triangles.size(), model.Modes()));
  }
  if (static_cast<std::size_t>(model.modes.rows()) != 3 * points) {
    Fail(name, fmt::format("the modes move {} coordinates, and the mean mesh has {} (3 x {} "
                           "points); both must be of one mesh, in one order of points",
                           model.modes.rows(), 3 * points, points));
  }
  for (const Triangle& t : model.mean.triangles) {
    if (!AreCorners(t, points)) {
      Fail(name, fmt::format("a triangle has the corners {}, and there are {} points",
                             fmt::join(t, ", "), points));
    }
  }
  if (!std::ranges::all_of(model.mean.points, [](const Vec3& p) { return p.allFinite(); }) ||
      !model.modes.allFinite()) {
    Fail(name, "a coordinate of the mean or of a mode is not finite");
  }
}

std::vector<Vec3> ShapeAt(const ShapeModel& model, const Eigen::VectorXd& coefficients) {
  if (coefficients.size() != model.Modes()) {
    throw InputError(fmt::format("shape model: {} coefficients for {} modes; give one per mode",
                                 coefficients.size(), model.Modes()));
  }
  const Eigen::VectorXd moves = model.modes * coefficients;
  std::vector<Vec3> points = model.mean.points;
  for (std::size_t v = 0; v < points.size(); ++v) {
    points[v] += moves.segment<3>(3 * static_cast<Eigen::Index>(v));
  }
  return points;
}

Vec3 FindPosition(const ModelPoint& at, const TriMesh& mean, const std::vector<Vec3>& points) {
  const Triangle& t = mean.triangles.at(at.triangle);
  return at.weights[0] * points[t[0]] + at.weights[1] * points[t[1]] + at.weights[2] * points[t[2]];
}

namespace {

Vec3 MeanPoint(const std::vector<Vec3>& points) {
  const Vec3 sum = std::accumulate(points.begin(), points.end(), Vec3(Vec3::Zero()));
  return sum / static_cast<double>(points.size());
}

std::span<const double> AsSpan(const Eigen::VectorXd& v) {
  return {v.data(), static_cast<std::size_t>(v.size())};
}

}  // namespace

ShapeFrame CentredFrame(const ShapeModel& model) { return {MeanPoint(model.mean.points)}; }

ShapeParameters StartParameters(const ShapeFrame& frame, const Similarity& subject_from_model,
                                Eigen::Index modes, Eigen::Index centres) {
  return {.pose = MakePose(subject_from_model.scale, subject_from_model.rotation,
                           subject_from_model * frame.centre),
          .coefficients = Eigen::VectorXd::Zero(modes),
          .field = Eigen::VectorXd::Zero(3 * centres)};
}

ShapeParameters MoveParameters(const ShapeParameters& from, const Eigen::VectorXd& step) {
  return {.pose = MovePose(from.pose, step.head<7>()),
          .coefficients = from.coefficients + step.segment(7, from.coefficients.size()),
          .field = from.field + step.segment(7 + from.coefficients.size(), from.field.size())};
}

ShapeParameters PartOfWay(const ShapeParameters& from, const ShapeParameters& to, double fraction) {
  Eigen::VectorXd step(from.size());
  step << StepBetween(from.pose, to.pose), to.coefficients - from.coefficients,
      to.field - from.field;
  return MoveParameters(from, fraction * step);
}

Similarity MakeSimilarity(const ShapeFrame& frame, const ShapeParameters& parameters) {
  Similarity similarity;
  similarity.scale = std::exp(parameters.pose[0]);
  similarity.rotation = PoseRotation(parameters.pose);
  similarity.translation =
      Vec3::Map(&parameters.pose[5]) - similarity.scale * (similarity.rotation * frame.centre);
  return similarity;
}

ShapeRow VertexRow(const ShapeModel& model, const Eigen::MatrixXd& field, int vertex) {
  return {model.mean.points[vertex], model.modes.middleRows<3>(3 * Eigen::Index{vertex}),
          field.row(vertex)};
}

ShapeRow PointRowAt(const ShapeModel& model, const Eigen::MatrixXd& field, const ModelPoint& at) {
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

ShapeRow MeanRow(const ShapeModel& model, const Eigen::MatrixXd& field,
                 const std::vector<ModelPoint>& at) {
  ShapeRow mean = PointRowAt(model, field, at.front());
  for (std::size_t k = 1; k < at.size(); ++k) {
    const ShapeRow row = PointRowAt(model, field, at[k]);
    mean.mean += row.mean;
    mean.modes += row.modes;
    mean.field += row.field;
  }
  const auto count = static_cast<double>(at.size());
  return {mean.mean / count, mean.modes / count, mean.field / count};
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
  const Mat3 linear = std::exp(pose[0]) * PoseRotation(pose);
  const Vec3 arm = linear * local;
  if (derivatives != nullptr) {
    derivatives->pose.col(0) = arm;
    derivatives->pose.middleCols<3>(1) = -CrossMatrix(arm);
    derivatives->pose.rightCols<3>().setIdentity();
    derivatives->linear = linear;
  }
  return arm + Vec3(pose[5], pose[6], pose[7]);
}

Vec3 PlacedPoint(const ShapeFrame& frame, const ShapeRow& row, const ShapeParameters& parameters,
                 ShapeDerivatives* derivatives) {
  return PlacedPoint(frame, row, parameters.pose, AsSpan(parameters.coefficients),
                     AsSpan(parameters.field), derivatives);
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
  const Similarity similarity = MakeSimilarity(frame, parameters);
  std::vector<Vec3> points;
  for (Eigen::Index v = 0; v < field.rows(); ++v) {
    points.push_back(similarity * (shape[v] + field_moves.row(v).transpose()));
  }
  return points;
}

}  // namespace semblance::problems
