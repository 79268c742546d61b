// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/least_squares/linear_cost.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "fitting/least_squares/qr_compression.h"

namespace semblance::fitting {
namespace {

// The vertices with a non-zero column, each once, in their given order.
std::vector<int> UsedVertices(const Eigen::MatrixXd& a, std::span<const int> vertices) {
  std::vector<int> used;
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const bool known = std::find(used.begin(), used.end(), vertices[k]) != used.end();
    if (!known && !a.col(k).isZero(0)) {
      used.push_back(vertices[k]);
    }
  }
  return used;
}

Eigen::MatrixXd Gathered(const Eigen::MatrixXd& a, std::span<const int> vertices,
                         const std::vector<int>& used) {
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(a.rows(), used.size());
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const auto at = std::find(used.begin(), used.end(), vertices[k]);
    if (at != used.end()) {
      sums.col(at - used.begin()) += a.col(k);
    }
  }
  return sums;
}

}  // namespace

LinearCost::LinearCost(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b)
    : a_(std::move(a)), b_(std::move(b)) {
  mutable_parameter_block_sizes()->assign(a_->cols(), 3);
  set_num_residuals(3 * static_cast<int>(a_->rows()));
}

bool LinearCost::Evaluate(double const* const* parameters, double* residuals,
                          double** jacobians) const {
  Eigen::Map<Rows3> r(residuals, a_->rows(), 3);
  r = -b_;
  for (Eigen::Index k = 0; k < a_->cols(); ++k) {
    r += a_->col(k) * Eigen::Map<const Eigen::RowVector3d>(parameters[k]);
  }
  for (Eigen::Index k = 0; jacobians != nullptr && k < a_->cols(); ++k) {
    if (jacobians[k] == nullptr) {
      continue;
    }
    Eigen::Map<Rows3> jacobian(jacobians[k], 3 * a_->rows(), 3);
    jacobian.setZero();
    for (Eigen::Index row = 0; row < a_->rows(); ++row) {
      jacobian.block<3, 3>(3 * row, 0).diagonal().setConstant((*a_)(row, k));
    }
  }
  return true;
}

void AddLinearResidual(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
                       std::span<const int> vertices, std::unique_ptr<ceres::LossFunction> loss,
                       ControlNet& net, ceres::Problem& problem) {
  const std::vector<int> used = UsedVertices(*a, vertices);
  if (used.size() != vertices.size()) {
    a = std::make_shared<const Eigen::MatrixXd>(Gathered(*a, vertices, used));
  }
  std::vector<double*> blocks;
  for (const int vertex : used) {
    blocks.push_back(net.vertices[vertex].data());
  }
  if (!blocks.empty()) {
    problem.AddResidualBlock(new LinearCost(std::move(a), std::move(b)), loss.release(), blocks);
  }
}

CoupledCost::CoupledCost(std::shared_ptr<const Eigen::MatrixXd> a, Eigen::VectorXd b)
    : a_(std::move(a)), b_(std::move(b)) {
  mutable_parameter_block_sizes()->assign(a_->cols() / 3, 3);
  set_num_residuals(static_cast<int>(a_->rows()));
}

bool CoupledCost::Evaluate(double const* const* parameters, double* residuals,
                           double** jacobians) const {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  Eigen::Map<Eigen::VectorXd> r(residuals, a_->rows());
  r = -b_;
  for (Eigen::Index k = 0; k < a_->cols() / 3; ++k) {
    r += a_->middleCols<3>(3 * k) * Eigen::Map<const Eigen::Vector3d>(parameters[k]);
    if (jacobians != nullptr && jacobians[k] != nullptr) {
      Eigen::Map<RowMajor>(jacobians[k], a_->rows(), 3) = a_->middleCols<3>(3 * k);
    }
  }
  return true;
}

void AddCoupledResidual(const Eigen::MatrixXd& a, Eigen::VectorXd b, std::span<const int> vertices,
                        ControlNet& net, ceres::Problem& problem) {
  std::vector<int> used(vertices.begin(), vertices.end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(a.rows(), 3 * used.size());
  std::vector<double*> blocks;
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const auto at = std::lower_bound(used.begin(), used.end(), vertices[k]) - used.begin();
    sums.middleCols<3>(3 * at) += a.middleCols<3>(3 * k);
  }
  for (const int vertex : used) {
    blocks.push_back(net.vertices[vertex].data());
  }
  problem.AddResidualBlock(
      new CoupledCost(std::make_shared<const Eigen::MatrixXd>(std::move(sums)), std::move(b)),
      nullptr, blocks);
}

void ProblemSink::Add(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
                      std::span<const int> vertices) {
  CompressShared(a, b);
  AddLinearResidual(std::move(a), std::move(b), vertices, nullptr, net_, problem_);
}

}  // namespace semblance::fitting
