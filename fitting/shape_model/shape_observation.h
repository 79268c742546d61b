// SPDX-License-Identifier: GPL-3.0-or-later
// What is known of where one point of a shape lies, and how well.
#pragma once

#include <Eigen/Core>

#include "fitting/shape_model/shape_parameters.h"

namespace semblance {

// Costs weight * Huber_width(|whitening (x - position)|^2), x the placed point; Huber_w(s) = s up
// to w^2, then 2 w sqrt(s) - w^2.
struct ShapeObservation {
  ShapeRow row;
  Vec3 position = Vec3::Constant(kNaN);  // mm
  Eigen::Matrix<double, Eigen::Dynamic, 3> whitening;
  double loss_width = kNaN;
  double weight = 1;
  Vec3 shared_mm = Vec3::Zero();  // how far one standard deviation of an error that all
                                  // observations share moves the position
  double smooth_sd_mm = 0;        // of an error along the whitening's only row that resembles those
                                  // of its neighbours; 0: it errs alone, as whitening says
};

// How sure a point is in its directions.
struct PointSpread {
  Vec3 normal = Vec3::Constant(kNaN);  // unit, of the shape
  double normal_sd_mm = kNaN;          // > 0, along the normal
  double tangent_sd_mm = kNaN;         // > 0, across it
  Vec3 direction = Vec3::Zero();       // unit, of a further error of its own
  double along_sd_mm = 0;
};

// W with W' W the inverse of
//   C = normal_sd^2 n n' + tangent_sd^2 (1 - n n') + along_sd^2 d d'.
Eigen::Matrix3d WhiteningOf(const PointSpread& spread);

// The factor by which the loss lowers the weight of the observation at these parameters, in (0, 1].
double LossWeight(const ShapeObservation& seen, const Vec3& placed);

}  // namespace semblance
