// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/shape_model/shape_cost.h"

#include <ceres/cost_function.h>
#include <ceres/normal_prior.h>
#include <ceres/problem.h>

#include <algorithm>

namespace semblance::problems {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class ShapeCost final : public ceres::CostFunction {
 public:
  ShapeCost(const ShapeFrame& frame, const ShapeObservation& observation)
      : frame_(frame), seen_(observation) {
    set_num_residuals(static_cast<int>(seen_.whitening.rows()));
    *mutable_parameter_block_sizes() = {7, static_cast<int>(seen_.row.modes.cols())};
    if (seen_.row.field.size() > 0) {
      mutable_parameter_block_sizes()->push_back(static_cast<int>(3 * seen_.row.field.size()));
    }
  }

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const std::size_t modes = seen_.row.modes.cols(), field = 3 * seen_.row.field.size();
    ShapeDerivatives derivatives;
    const Vec3 x = PlacedPoint(frame_, seen_.row, {parameters[0], 7}, {parameters[1], modes},
                               {field > 0 ? parameters[2] : nullptr, field}, &derivatives);
    const Eigen::Index rows = seen_.whitening.rows();
    Eigen::Map<Eigen::VectorXd>(residuals, rows) = seen_.whitening * (x - seen_.position);
    if (jacobians != nullptr) {
      Eigen::MatrixXd all(rows, 7 + modes + field);
      for (Eigen::Index r = 0; r < rows; ++r) {
        all.row(r) = DerivativeAlong(seen_.whitening.row(r).transpose(), seen_.row, derivatives);
      }
      WriteShapeJacobian(all, seen_.row, jacobians);
    }
    return true;
  }

 private:
  const ShapeFrame& frame_;
  const ShapeObservation& seen_;
};

}  // namespace

std::vector<double*> ShapeBlocks(ShapeParameters& parameters) {
  std::vector<double*> blocks = {parameters.pose.data(), parameters.coefficients.data()};
  if (parameters.field.size() > 0) {
    blocks.push_back(parameters.field.data());
  }
  return blocks;
}

ceres::CostFunction* MakeShapeCost(const ShapeFrame& frame, const ShapeObservation& observation) {
  return new ShapeCost(frame, observation);
}

void WriteShapeJacobian(const Eigen::MatrixXd& rows, const ShapeRow& row, double** jacobians) {
  Eigen::Index begin = 0;
  const std::array<Eigen::Index, 3> sizes = {7, row.modes.cols(), 3 * row.field.size()};
  for (std::size_t block = 0; block < sizes.size() && sizes[block] > 0; ++block) {
    if (jacobians[block] != nullptr) {
      Eigen::Map<RowMajor>(jacobians[block], rows.rows(), sizes[block]) =
          rows.middleCols(begin, sizes[block]);
    }
    begin += sizes[block];
  }
}

int AddShapePriors(const ShapePrior& prior, const std::array<double, 7>& start_pose,
                   ShapeParameters& parameters, ceres::Problem& problem) {
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(parameters.size());
  std::copy(start_pose.begin() + 1, start_pose.end(), mean.begin() + 1);
  const Eigen::VectorXd precision = prior.Deviations(parameters).cwiseInverse();
  Eigen::Index begin = 0;
  int blocks = 0;
  for (double* const block : ShapeBlocks(parameters)) {
    const Eigen::Index size = blocks == 0   ? 7
                              : blocks == 1 ? parameters.coefficients.size()
                                            : parameters.field.size();
    const Eigen::MatrixXd root = precision.segment(begin, size).asDiagonal();
    const Eigen::VectorXd of_block = mean.segment(begin, size);
    problem.AddResidualBlock(new ceres::NormalPrior(root, of_block), nullptr, block);
    begin += size;
    ++blocks;
  }
  return blocks;
}

}  // namespace semblance::problems
