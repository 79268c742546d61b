// SPDX-License-Identifier: GPL-3.0-or-later
// How sure an estimated shape is: the normal distribution about the most likely parameters.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "fitting/shape_model/shape_observation.h"

namespace semblance {

// Deviations of the parameters before anything is seen.
struct ShapePrior {
  double scale_sd = 0.03;       // of ln s, about 0
  double rotation_sd = 1;       // rad, about the start
  double translation_sd = 100;  // mm, about the start
  // Coefficients and field: 1, about 0.

  Eigen::VectorXd Deviations(Eigen::Index parameters) const;
};

// The inverse of the parameters' covariance: the prior's, and J' W J of each observation at its
// loss's weight.
Eigen::MatrixXd InformationOf(const ShapeFrame& frame, const ShapeParameters& parameters,
                              std::span<const ShapeObservation> seen, const ShapePrior& prior);

// Standard deviations of the placed points of `rows` along `directions` (unit, one per row), mm.
// information: positive definite.
std::vector<double> DeviationsAlong(const ShapeFrame& frame, const ShapeParameters& parameters,
                                    const Eigen::MatrixXd& information,
                                    std::span<const ShapeRow> rows,
                                    std::span<const Vec3> directions, int threads);

}  // namespace semblance
