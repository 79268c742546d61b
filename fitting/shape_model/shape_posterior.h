// SPDX-License-Identifier: GPL-3.0-or-later
// How sure an estimated shape is: the normal distribution about the most likely parameters.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "fitting/shape_model/shape_observation.h"

namespace semblance {

// Deviations of the parameters before anything is seen.
struct ShapePrior {
  double scale_sd = 0.03;       // of ln s, about 0
  double rotation_sd = 1;       // rad, about the start
  double translation_sd = 100;  // mm, about the start
  double mode_sd = 1;           // of the coefficients, about 0, as the estimate takes them
  double population_sd = 1;     // of the same, as people have them
  // Field: 1, about 0.

  Eigen::VectorXd Deviations(const ShapeParameters& parameters) const;  // with mode_sd
};

// What the observations leave open: the parameters err with the covariance H^-1 M H^-1.
struct ShapePosterior {
  Eigen::MatrixXd information;  // H, by which the estimate weighs: the prior's, and J' W J
  Eigen::MatrixXd spread;       // M, of what pulls at it wrongly; H where all errs as is assumed
};

// The estimate weighs as if each observation erred alone and coefficients had mode_sd. M knows
// better (White 1980): coefficients have population_sd, an error that observations share pulls at
// all of them, and a smooth one of deviations s_j at observations j, k together by
//   s_j s_k exp(-|x_j - x_k|^2 / (2 length^2)), x their positions.
// All weights are those of the observations' losses. smooth_length_mm > 0.
ShapePosterior PosteriorOf(const ShapeFrame& frame, const ShapeParameters& parameters,
                           std::span<const ShapeObservation> seen, const ShapePrior& prior,
                           double smooth_length_mm);

// Standard deviations of the placed points of `rows` along `directions` (unit, one per row), mm:
// the root of a' H^-1 M H^-1 a, a the derivative of a point along its direction.
std::vector<double> DeviationsAlong(const ShapeFrame& frame, const ShapeParameters& parameters,
                                    const ShapePosterior& posterior, std::span<const ShapeRow> rows,
                                    std::span<const Vec3> directions, int threads);

// Parameters drawn from the normal distribution about `parameters`. Same bytes for the same seed.
ShapeParameters DrawnAbout(const ShapeParameters& parameters, const ShapePosterior& posterior,
                           std::uint64_t random_seed);

}  // namespace semblance
