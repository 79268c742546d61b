// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/shape_model/shape_cost.h"

#include <ceres/cost_function.h>
#include <ceres/normal_prior.h>
#include <ceres/problem.h>

#include <algorithm>
#include <numeric>
#include <ranges>

namespace semblance::problems {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class ShapeCost final : public ceres::CostFunction {
 public:
  ShapeCost(const ShapeFrame& frame, const ShapeObservation& observation)
      : frame_(frame), seen_(observation) {
    set_num_residuals(static_cast<int>(seen_.whitening.rows()));
    *mutable_parameter_block_sizes() =
        ShapeBlockSizes(seen_.row.modes.cols(), 3 * seen_.row.field.size());
  }

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const std::size_t modes = seen_.row.modes.cols(), field = 3 * seen_.row.field.size();
    const Eigen::VectorXd values = JoinShapeBlocks(parameter_block_sizes(), parameters);
    ShapeDerivatives derivatives;
    const Vec3 x = PlacedPoint(frame_, seen_.row, {values.data(), 7}, {values.data() + 7, modes},
                               {values.data() + 7 + modes, field}, &derivatives);
    const Eigen::Index rows = seen_.whitening.rows();
    Eigen::Map<Eigen::VectorXd>(residuals, rows) = seen_.whitening * (x - seen_.position);
    if (jacobians != nullptr) {
      Eigen::MatrixXd all(rows, 7 + modes + field);
      for (Eigen::Index r = 0; r < rows; ++r) {
        all.row(r) = DerivativeAlong(seen_.whitening.row(r).transpose(), seen_.row, derivatives);
      }
      WriteShapeJacobian(all, parameter_block_sizes(), jacobians);
    }
    return true;
  }

 private:
  const ShapeFrame& frame_;
  const ShapeObservation& seen_;
};

}  // namespace

std::vector<int> ShapeBlockSizes(std::size_t modes, std::size_t field) {
  constexpr std::size_t kLargest = 32;
  std::vector<int> sizes = {7};
  for (std::size_t left : {modes, field}) {
    for (; left > 0; left -= static_cast<std::size_t>(sizes.back())) {
      sizes.push_back(static_cast<int>(std::min(left, kLargest)));
    }
  }
  return sizes;
}

std::vector<double*> ShapeBlocks(ShapeParameters& parameters) {
  std::vector<double*> blocks = {parameters.pose.data()};
  const auto coefficients = static_cast<std::size_t>(parameters.coefficients.size());
  std::size_t begin = 0;  // in the coefficients, followed by the field
  for (const int size :
       ShapeBlockSizes(coefficients, static_cast<std::size_t>(parameters.field.size())) |
           std::views::drop(1)) {
    blocks.push_back(begin < coefficients ? parameters.coefficients.data() + begin
                                          : parameters.field.data() + (begin - coefficients));
    begin += static_cast<std::size_t>(size);
  }
  return blocks;
}

Eigen::VectorXd JoinShapeBlocks(std::span<const int> sizes, const double* const* blocks) {
  Eigen::VectorXd values(std::accumulate(sizes.begin(), sizes.end(), 0));
  double* at = values.data();
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    at = std::copy_n(blocks[k], sizes[k], at);
  }
  return values;
}

ceres::CostFunction* MakeShapeCost(const ShapeFrame& frame, const ShapeObservation& observation) {
  return new ShapeCost(frame, observation);
}

void WriteShapeJacobian(const Eigen::MatrixXd& rows, std::span<const int> sizes,
                        double** jacobians) {
  Eigen::Index begin = 0;
  for (std::size_t block = 0; begin < rows.cols(); ++block) {
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
  const std::vector<double*> blocks = ShapeBlocks(parameters);
  const std::vector<int> sizes =
      ShapeBlockSizes(static_cast<std::size_t>(parameters.coefficients.size()),
                      static_cast<std::size_t>(parameters.field.size()));
  Eigen::Index begin = 0;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const Eigen::MatrixXd root = precision.segment(begin, sizes[k]).asDiagonal();
    const Eigen::VectorXd of_block = mean.segment(begin, sizes[k]);
    problem.AddResidualBlock(new ceres::NormalPrior(root, of_block), nullptr, blocks[k]);
    begin += sizes[k];
  }
  return static_cast<int>(blocks.size());
}

}  // namespace semblance::problems
