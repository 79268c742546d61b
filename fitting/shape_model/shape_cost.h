// SPDX-License-Identifier: GPL-3.0-or-later
// One observation of a shape as a residual of Ceres.
#pragma once

#include <ceres/cost_function.h>

#include "fitting/shape_model/shape_observation.h"
#include "fitting/shape_model/shape_parameters.h"

namespace semblance {

// whitening * (x - position), x the placed point of the observation. Parameter blocks: the pose,
// the coefficients and, where there is one, the field.
class ShapeCost final : public ceres::CostFunction {
 public:
  // Both must outlive the cost.
  ShapeCost(const ShapeFrame& frame, const ShapeObservation& observation);
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const ShapeFrame& frame_;
  const ShapeObservation& seen_;
};

}  // namespace semblance
