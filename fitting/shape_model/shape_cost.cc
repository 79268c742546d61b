// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/shape_model/shape_cost.h"

#include <cstddef>

namespace semblance {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace

ShapeCost::ShapeCost(const ShapeFrame& frame, const ShapeObservation& observation)
    : frame_(frame), seen_(observation) {
  set_num_residuals(static_cast<int>(seen_.whitening.rows()));
  mutable_parameter_block_sizes()->push_back(7);
  mutable_parameter_block_sizes()->push_back(static_cast<int>(seen_.row.modes.cols()));
  if (seen_.row.field.size() > 0) {
    mutable_parameter_block_sizes()->push_back(static_cast<int>(3 * seen_.row.field.size()));
  }
}

bool ShapeCost::Evaluate(const double* const* parameters, double* residuals,
                         double** jacobians) const {
  const std::size_t modes = seen_.row.modes.cols(), field = 3 * seen_.row.field.size();
  ShapeDerivatives derivatives;
  const Vec3 x = PlacedPoint(frame_, seen_.row, {parameters[0], 7}, {parameters[1], modes},
                             {field > 0 ? parameters[2] : nullptr, field}, &derivatives);
  const Eigen::Index rows = seen_.whitening.rows();
  Eigen::Map<Eigen::VectorXd>(residuals, rows) = seen_.whitening * (x - seen_.position);
  if (jacobians == nullptr) {
    return true;
  }
  RowMajor all(rows, 7 + modes + field);
  for (Eigen::Index r = 0; r < rows; ++r) {
    all.row(r) = DerivativeAlong(seen_.whitening.row(r).transpose(), seen_.row, derivatives);
  }
  Eigen::Index begin = 0;
  for (std::size_t block = 0; block < parameter_block_sizes().size(); ++block) {
    const int size = parameter_block_sizes()[block];
    if (jacobians[block] != nullptr) {
      Eigen::Map<RowMajor>(jacobians[block], rows, size) = all.middleCols(begin, size);
    }
    begin += size;
  }
  return true;
}

}  // namespace semblance
