// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/joint_posterior.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "fitting/least_squares/sparse_factor.h"
#include "fitting/uncertainty/error_propagation.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

using fitting::SparseFactor;
using fitting::SparseMatrix;

// The factor by which weight and loss multiply the observation's rows.
double RowFactor(const SurfaceObservation& seen, const Vec3& point) {
  const double residual = (seen.whitening * (point - seen.position)).norm();
  const double loss = residual <= seen.loss_width ? 1 : seen.loss_width / residual;
  return std::sqrt(seen.weight * loss);
}

// An observation with a smooth error: its row, and the error's place and
// deviation in the units of the row.
struct SmoothError {
  Eigen::Index row = -1;
  Vec3 at = Vec3::Constant(kNaN);
  double sd = kNaN;
};

Eigen::MatrixXd SmoothCovariance(const std::vector<SmoothError>& errors, double length_mm) {
  const Eigen::Index count = std::ssize(errors);
  Eigen::MatrixXd covariance(count, count);
  for (Eigen::Index j = 0; j < count; ++j) {
    for (Eigen::Index k = 0; k < count; ++k) {
      const double squared = (errors[j].at - errors[k].at).squaredNorm();
      covariance(j, k) =
          errors[j].sd * errors[k].sd * std::exp(-squared / (2 * length_mm * length_mm));
    }
  }
  return covariance;
}

SparseMatrix SmoothRows(const SparseMatrix& jacobian, const std::vector<SmoothError>& errors) {
  std::vector<Eigen::Triplet<double>> ones;
  for (std::size_t k = 0; k < errors.size(); ++k) {
    ones.emplace_back(k, errors[k].row, 1.0);
  }
  SparseMatrix choice(std::ssize(errors), jacobian.rows());
  choice.setFromTriplets(ones.begin(), ones.end());
  return choice * jacobian;
}

SparseMatrix WithoutRows(const SparseMatrix& matrix, const std::vector<SmoothError>& errors) {
  Eigen::VectorXd kept = Eigen::VectorXd::Ones(matrix.rows());
  for (const SmoothError& error : errors) {
    kept[error.row] = 0;
  }
  return kept.asDiagonal() * matrix;
}

Eigen::VectorXd DrawNormals(Eigen::Index count, Random& random) {
  return Eigen::VectorXd::NullaryExpr(count, [&random] { return random.Normal(); });
}

// H, lower triangle, as one product of all rows. In a sum of the parts' products the additions took
// longer than the products, because each part fills the same large dense block.
SparseMatrix MakeInformation(const JointRows& rows) {
  const std::array parts = {&rows.dowels, &rows.seeds, &rows.marks, &rows.residual_field,
                            &rows.face_model};
  Eigen::Index count = 0;
  for (const SparseMatrix* const part : parts) {
    count += part->rows();
  }
  SparseMatrix columns(rows.face_model.cols(), count);  // the rows as columns
  Eigen::Index begin = 0;
  for (const SparseMatrix* const part : parts) {
    columns.middleCols(begin, part->rows()) = SparseMatrix(part->transpose());
    begin += part->rows();
  }
  return SparseMatrix(columns * SparseMatrix(columns.transpose())).triangularView<Eigen::Lower>();
}

}  // namespace

// M = H + smooth' errors smooth + shared shared' + diag(people).
struct JointPosterior::Parts {
  std::unique_ptr<const SparseFactor> information;  // H
  SparseMatrix smooth;                              // the rows with a smooth error
  Eigen::MatrixXd errors;  // their covariance, without that of independent errors, which H has
  Eigen::VectorXd shared;  // one standard deviation of the shared error, as a gradient
  Eigen::VectorXd people;  // what people differ more than H has it
  JointRows independent;   // the other rows; their errors are independent, with deviation 1

  // Takes the rows with a smooth error out of the observations' rows.
  void AddObservations(const std::vector<SurfaceObservation>& seen, SparseMatrix& jacobian,
                       double smooth_length_mm, const VertexModel& model, const JointState& state) {
    std::vector<SmoothError> smooth_errors;
    Eigen::VectorXd shift = Eigen::VectorXd::Zero(jacobian.rows());
    Eigen::Index row = 0;
    for (const SurfaceObservation& one : seen) {
      const double factor = RowFactor(one, state.Point(model, one.uv));
      if (one.smooth_sd_mm > 0) {
        smooth_errors.push_back(
            {row, one.position, factor * one.smooth_sd_mm * one.whitening.row(0).norm()});
      }
      shift.segment(row, one.whitening.rows()) = factor * one.whitening * one.shared_mm;
      row += one.whitening.rows();
    }
    shared += jacobian.transpose() * shift;
    if (!smooth_errors.empty()) {
      smooth = SmoothRows(jacobian, smooth_errors);
      errors = SmoothCovariance(smooth_errors, smooth_length_mm);
      errors.diagonal().array() -= 1;
      jacobian = WithoutRows(jacobian, smooth_errors);
    }
  }

  // A gradient with the covariance M.
  Eigen::VectorXd DrawGradient(Random& random) const {
    Eigen::VectorXd gradient = shared * random.Normal();
    for (const SparseMatrix* const part :
         {&independent.dowels, &independent.seeds, &independent.marks, &independent.residual_field,
          &independent.face_model}) {
      gradient += part->transpose() * DrawNormals(part->rows(), random);
    }
    if (smooth.rows() > 0) {
      Eigen::MatrixXd covariance = errors;
      covariance.diagonal().array() += 1;
      const Eigen::MatrixXd root = fitting::PivotedRoot(std::move(covariance), 1e-9);
      gradient += smooth.transpose() * (root * DrawNormals(root.cols(), random));
    }
    return gradient;
  }

  // The diagonal of A' H^-1 M H^-1 A.
  Eigen::VectorXd Variances(const Eigen::MatrixXd& along) const {
    const Eigen::MatrixXd x = information->Solve(along);
    Eigen::VectorXd sum = along.cwiseProduct(x).colwise().sum();
    sum += (x.array().square().colwise() * people.array()).colwise().sum().matrix().transpose();
    if (smooth.rows() > 0) {
      const Eigen::MatrixXd pulled = smooth * x;
      sum += pulled.cwiseProduct(errors * pulled).colwise().sum().transpose();
    }
    return sum + (shared.transpose() * x).cwiseAbs2().transpose();
  }
};

JointPosterior::JointPosterior(const VertexModel& model, const JointData& data,
                               const JointWeights& weights, double smooth_length_mm, int level,
                               const JointState& state)
    : model_(model), level_(level), state_(state) {
  auto parts = std::make_unique<Parts>();
  parts->independent = LinearizeJointStep(model, data, weights, level, state);
  JointRows& rows = parts->independent;
  parts->information = std::make_unique<const SparseFactor>(MakeInformation(rows), 0);
  parts->shared = Eigen::VectorXd::Zero(rows.face_model.cols());
  parts->AddObservations(data.dowels, rows.dowels, smooth_length_mm, model, state);
  parts->AddObservations(data.seeds, rows.seeds, smooth_length_mm, model, state);
  const Eigen::Index modes = state.parameters.coefficients.size();
  const ShapePrior& prior = weights.prior;
  parts->people = Eigen::VectorXd::Zero(rows.face_model.cols());
  parts->people.segment(7, modes).setConstant(
      (std::pow(prior.population_sd / prior.mode_sd, 2) - 1) / std::pow(prior.mode_sd, 2));
  Eigen::VectorXd among_people = Eigen::VectorXd::Ones(rows.face_model.cols());
  among_people.segment(7, modes).setConstant(prior.population_sd / prior.mode_sd);
  rows.face_model = rows.face_model * among_people.asDiagonal();
  parts_ = std::move(parts);
}

JointPosterior::~JointPosterior() = default;

std::vector<double> JointPosterior::DeviationsAlong(std::span<const Vec2> uv,
                                                    std::span<const Vec3> directions) const {
  constexpr std::size_t kBlock = 128;  // right-hand sides per solve; bounds the memory
  std::vector<double> deviations(uv.size(), kNaN);
  if (!parts_->information->usable()) {
    return deviations;
  }
  const Eigen::Index model_size = state_.parameters.size();
  for (std::size_t begin = 0; begin < uv.size(); begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, uv.size());
    Eigen::MatrixXd along =
        Eigen::MatrixXd::Zero(parts_->people.size(), std::ssize(uv.subspan(begin, end - begin)));
    for (std::size_t k = begin; k < end; ++k) {
      auto column = along.col(static_cast<Eigen::Index>(k - begin));
      const ShapeRow row = model_.RowAt(uv[k]);
      ShapeDerivatives derivatives;
      PlacedPoint(state_.frame, row, state_.parameters, &derivatives);
      column.head(model_size) = DerivativeAlong(directions[k], row, derivatives).transpose();
      const Stencil stencil = StencilAt(model_.shape, level_, uv[k]);
      for (int i = 0; i < 16; ++i) {
        column.segment<3>(model_size + 3 * Eigen::Index{stencil.index[i]}) +=
            stencil.weight[i] * directions[k];
      }
    }
    const Eigen::VectorXd variances = parts_->Variances(along);
    for (std::size_t k = begin; k < end; ++k) {
      deviations[k] = std::sqrt(std::max(variances[static_cast<Eigen::Index>(k - begin)], 0.0));
    }
  }
  return deviations;
}

JointState JointPosterior::Draw(std::uint64_t random_seed) const {
  JointState drawn = state_;
  if (!parts_->information->usable()) {
    return drawn;
  }
  Random random(random_seed);
  const Eigen::VectorXd step = parts_->information->Solve(parts_->DrawGradient(random));
  const Eigen::Index model_size = state_.parameters.size();
  drawn.parameters = MoveParameters(state_.parameters, step.head(model_size));
  ControlNet move = state_.residual[level_];
  for (std::size_t k = 0; k < move.vertices.size(); ++k) {
    move.vertices[k] = step.segment<3>(model_size + 3 * static_cast<Eigen::Index>(k));
  }
  MoveDeviation(model_.shape, level_, std::move(move), drawn);
  return drawn;
}

}  // namespace semblance::problems
