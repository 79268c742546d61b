// SPDX-License-Identifier: GPL-3.0-or-later
// The parameters of a shape model as blocks of a ceres::Problem: the cost of an observation of a
// point of the model, and the prior of the parameters.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "problems/face/shape_model/shape_model.h"
#include "problems/face/shape_model/shape_posterior.h"

namespace ceres {
class CostFunction;
class Problem;
}  // namespace ceres

namespace semblance::problems {

// The blocks of the parameters: the pose, then the coefficients and the field in short parts. Ceres
// computes only one half of the symmetric normal matrix block by block, but all of each block on
// its diagonal. So a long vector takes twice the time if it is one block.
std::vector<double*> ShapeBlocks(ShapeParameters& parameters);

// The sizes of these blocks, for `modes` coefficients and a field of `field` numbers.
std::vector<int> ShapeBlockSizes(std::size_t modes, std::size_t field);

// The values of these blocks, as Ceres passes them, in one vector.
Eigen::VectorXd JoinShapeBlocks(std::span<const int> sizes, const double* const* blocks);

// The residual whitening * (x - position), where x is the placed point of the observation, over the
// blocks of ShapeBlocks. Both arguments must outlive the cost, which the caller owns.
ceres::CostFunction* MakeShapeCost(const ShapeFrame& frame, const ShapeObservation& observation);

// Writes derivatives by pose, coefficients and field (DerivativeAlong, one row per residual) to the
// blocks of Ceres' Jacobian that begin at jacobians[0]; null blocks are skipped.
void WriteShapeJacobian(const Eigen::MatrixXd& rows, std::span<const int> sizes,
                        double** jacobians);

// Adds the normal priors of pose, coefficients and field. start_pose: the mean of the pose, apart
// from ln s, whose mean is 0, the model's own size. Returns the number of residual blocks added.
int AddShapePriors(const ShapePrior& prior, const std::array<double, 7>& start_pose,
                   ShapeParameters& parameters, ceres::Problem& problem);

}  // namespace semblance::problems
