// SPDX-License-Identifier: GPL-3.0-or-later
// Residuals that are linear in control vertices.
#pragma once

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>

#include <Eigen/Core>
#include <memory>
#include <span>

#include "fitting/least_squares/qr_compression.h"
#include "surfaces/hspline/bspline.h"

namespace semblance::fitting {

// Residual A X - B, row by row in the order x y z. X (vertices x 3) holds the control vertices in
// mm, one parameter block of 3 doubles each; A is rows x vertices, scaled by its term; B is rows
// x 3. The Jacobian is the Kronecker product of A and the 3 x 3 identity.
class LinearCost final : public ceres::CostFunction {
 public:
  LinearCost(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  std::shared_ptr<const Eigen::MatrixXd> a_;
  Rows3 b_;
};

// Residual A x - b for terms that couple x, y and z. The vector x stacks the coordinates x y z of
// the control vertices, so A is rows x (3 vertices); b has as many rows.
class CoupledCost final : public ceres::CostFunction {
 public:
  CoupledCost(std::shared_ptr<const Eigen::MatrixXd> a, Eigen::VectorXd b);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  std::shared_ptr<const Eigen::MatrixXd> a_;
  Eigen::VectorXd b_;
};

// Adds a CoupledCost over the vertices of `net` with the given indices, three columns of `a` each.
// The columns of a repeated vertex are added up.
void AddCoupledResidual(const Eigen::MatrixXd& a, Eigen::VectorXd b, std::span<const int> vertices,
                        ControlNet& net, ceres::Problem& problem);

// Adds a LinearCost over the vertices of `net` with the given indices, one per column of `a`. The
// columns of a repeated vertex are added up, and a vertex whose columns are zero is left out.
// `loss` may be empty.
void AddLinearResidual(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
                       std::span<const int> vertices, std::unique_ptr<ceres::LossFunction> loss,
                       ControlNet& net, ceres::Problem& problem);

// Adds rows to a ceres::Problem as residuals over the vertices of `net`, parameter blocks of 3
// doubles each. Blocks with more rows than columns are compressed first (qr_compression.h).
class ProblemSink final : public RowSink {
 public:
  ProblemSink(ControlNet& net, ceres::Problem& problem) : net_(net), problem_(problem) {}
  void Add(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
           std::span<const int> vertices) override;

 private:
  ControlNet& net_;
  ceres::Problem& problem_;
};

}  // namespace semblance::fitting
