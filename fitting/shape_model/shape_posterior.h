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
  double mode_sd = 1;           // of the coefficients, about 0
  // Field: 1, about 0.

  Eigen::VectorXd Deviations(const ShapeParameters& parameters) const;
};

// The deviation that the estimate takes the coefficients to have, and the one that people have.
struct Population {
  double mode_sd = 1, population_sd = 1;
};

// What the observations leave open.
struct ShapePosterior {
  Eigen::MatrixXd information;  // inverse of the parameters' covariance, positive definite
  Eigen::VectorXd shared;       // J' W of one standard deviation of the error that all share
};

// information: the prior's, and J' W J of each observation at its loss's weight.
ShapePosterior PosteriorOf(const ShapeFrame& frame, const ShapeParameters& parameters,
                           std::span<const ShapeObservation> seen, const ShapePrior& prior);

// Standard deviations of the placed points of `rows` along `directions` (unit, one per row), mm.
// With H the information, a the derivative of a point along its direction, w of the modes, m the
// prior's mode_sd:
//   a' H^-1 a + (population_sd^2 / m^4 - 1 / m^2) |(H^-1 a)_w|^2 + (shared' H^-1 a)^2.
// The second part: the estimate takes coefficients of variance m^2, and the people's have
// population_sd^2. The third: it does not know of the shared error, which moves it so.
std::vector<double> DeviationsAlong(const ShapeFrame& frame, const ShapeParameters& parameters,
                                    const ShapePosterior& posterior, const Population& population,
                                    std::span<const ShapeRow> rows,
                                    std::span<const Vec3> directions, int threads);

}  // namespace semblance
