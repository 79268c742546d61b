// SPDX-License-Identifier: GPL-3.0-or-later
// Residuals that are linear in control vertices.
#pragma once

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>

#include <Eigen/Core>
#include <memory>
#include <span>

#include "fitting/least_squares/row_sink.h"
#include "surfaces/hspline/bspline.h"

namespace semblance {

// Residual A X - B, row by row, x y z. X (columns of A x 3) are the control vertices in mm, one
// parameter block of 3 each; A is rows x vertices, without unit or as its term scales it; B is
// rows x 3. The Jacobian is the Kronecker product of A and the 3 x 3 identity.
class LinearCost final : public ceres::CostFunction {
 public:
  LinearCost(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  std::shared_ptr<const Eigen::MatrixXd> a_;
  Rows3 b_;
};

// Residual A x - b where x stacks the coordinates x y z of the control vertices, 3 columns of A
// each: for terms that couple them. A is rows x 3 vertices, b has as many rows.
class CoupledCost final : public ceres::CostFunction {
 public:
  CoupledCost(std::shared_ptr<const Eigen::MatrixXd> a, Eigen::VectorXd b);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  std::shared_ptr<const Eigen::MatrixXd> a_;
  Eigen::VectorXd b_;
};

// Adds a CoupledCost over the vertices of `net` that `vertices` names; as AddLinearResidual.
void AddCoupledResidual(const Eigen::MatrixXd& a, Eigen::VectorXd b, std::span<const int> vertices,
                        ControlNet& net, ceres::Problem& problem);

// Adds a LinearCost over the vertices of `net` that `vertices` names, one per column of `a`. A
// vertex named twice gets the sum of its columns; one whose columns are zero is left out. `loss`
// may be empty.
void AddLinearResidual(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
                       std::span<const int> vertices, std::unique_ptr<ceres::LossFunction> loss,
                       ControlNet& net, ceres::Problem& problem);

// Rows become residuals over the vertices of `net`, a parameter block of 3 doubles each. Blocks
// with more rows than columns are reduced first (qr_compression.h).
class ProblemSink final : public RowSink {
 public:
  ProblemSink(ControlNet& net, ceres::Problem& problem) : net_(net), problem_(problem) {}
  void Add(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
           std::span<const int> vertices) override;

 private:
  ControlNet& net_;
  ceres::Problem& problem_;
};

}  // namespace semblance
