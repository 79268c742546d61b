// SPDX-License-Identifier: GPL-3.0-or-later
// Observations of a shape's points, and the posterior of the shape's parameters: a normal
// distribution about the most likely ones.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "problems/face/shape_model/shape_model.h"

namespace semblance::problems {

// An observation of one point x of the shape. Its cost is weight * Huber_width(|whitening (x -
// position)|^2), with Huber_w(s) = s for s <= w^2, else 2 w sqrt(s) - w^2.
struct ShapeObservation {
  ShapeRow row;
  Vec3 position = Vec3::Constant(kNaN);  // mm
  Eigen::Matrix<double, Eigen::Dynamic, 3> whitening;
  double loss_width = kNaN;
  double weight = 1;
  // The shift of the position by one standard deviation of an error that all observations share.
  Vec3 shared_mm = Vec3::Zero();
  // The standard deviation of an error along the whitening's only row that is correlated with those
  // of neighbours; 0: the error is independent and has the covariance of the whitening.
  double smooth_sd_mm = 0;
};

// The covariance of a point by its directions.
struct PointSpread {
  Vec3 normal = Vec3::Constant(kNaN);  // unit, of the shape
  double normal_sd_mm = kNaN;          // > 0, along the normal
  double tangent_sd_mm = kNaN;         // > 0, across it
  Vec3 direction = Vec3::Zero();       // unit, direction of a further independent error
  double along_sd_mm = 0;
};

// The matrix W for which W' W is the inverse of
//   C = normal_sd^2 n n' + tangent_sd^2 (1 - n n') + along_sd^2 d d'.
Eigen::Matrix3d MakeWhitening(const PointSpread& spread);

// The factor in (0, 1] by which the loss reduces the weight of the observation.
double LossWeight(const ShapeObservation& seen, const Vec3& placed);

// The prior standard deviations of the parameters.
struct ShapePrior {
  double scale_sd = 0.03;       // of ln s, about 0
  double rotation_sd = 1;       // rad, about the start
  double translation_sd = 100;  // mm, about the start
  double mode_sd = 1;           // of the coefficients, about 0, in the estimate
  double population_sd = 1;     // of the coefficients in the population
  // The coefficients of the field have standard deviation 1 about 0.

  Eigen::VectorXd Deviations(const ShapeParameters& parameters) const;  // with mode_sd
};

// The posterior covariance of the parameters is H^-1 M H^-1.
struct ShapePosterior {
  Eigen::MatrixXd information;  // H: the prior's, and J' W J
  Eigen::MatrixXd spread;  // M: covariance of the gradient; M = H under the model's assumptions
};

// The estimate assumes that the observations' errors are independent and that coefficients have
// mode_sd. M drops these assumptions (sandwich estimator; White 1980): coefficients have
// population_sd, a shared error acts on all observations, and the smooth errors of observations j
// and k at x_j and x_k, with standard deviations s_j and s_k, have the covariance
//   s_j s_k exp(-|x_j - x_k|^2 / (2 length^2)).
// All weights include those of the observations' losses. smooth_length_mm > 0.
ShapePosterior MakePosterior(const ShapeFrame& frame, const ShapeParameters& parameters,
                             std::span<const ShapeObservation> seen, const ShapePrior& prior,
                             double smooth_length_mm);

// The standard deviations of the placed points of `rows` along `directions` (unit, one per row),
// mm: the root of a' H^-1 M H^-1 a, where a is the derivative of a point along its direction.
std::vector<double> DeviationsAlong(const ShapeFrame& frame, const ShapeParameters& parameters,
                                    const ShapePosterior& posterior, std::span<const ShapeRow> rows,
                                    std::span<const Vec3> directions, int threads);

// Draws parameters from the normal distribution about `parameters`. The same seed gives the same
// bytes.
ShapeParameters DrawParameters(const ShapeParameters& parameters, const ShapePosterior& posterior,
                               std::uint64_t random_seed);

}  // namespace semblance::problems
