// SPDX-License-Identifier: GPL-3.0-or-later
// A smooth random displacement of a shape that its modes cannot express: a Gaussian process over
// the mean shape (Luethi et al. 2018), of low rank.
#pragma once

#include <Eigen/Core>
#include <span>

#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

struct SmoothFieldOptions {
  int centres = 110;
  double wide_sd_mm = 2;
  double wide_length_mm = 45;
  double fine_sd_mm = 1;
  double fine_length_mm = 20;
  double at_features = 0.5;
  double feature_reach_mm = 15;
};
template <class Visitor>
void Fields(Visitor& visit, SmoothFieldOptions& o) {
  visit(FieldInfo{.name = "centres",
                  .min = 0,
                  .max = 1000,
                  .doc = "number of points that span the field; more follow smaller details; 0: no "
                         "field, the modes alone"},
        o.centres);
  visit(FieldInfo{.name = "wide_sd_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "standard deviation of the wide part of the field"},
        o.wide_sd_mm);
  visit(FieldInfo{.name = "wide_length_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 500,
                  .doc = "correlation length of the wide part"},
        o.wide_length_mm);
  visit(FieldInfo{.name = "fine_sd_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "standard deviation of the fine part of the field"},
        o.fine_sd_mm);
  visit(FieldInfo{.name = "fine_length_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 500,
                  .doc = "correlation length of the fine part"},
        o.fine_length_mm);
  visit(FieldInfo{.name = "at_features",
                  .min = 0,
                  .max = 1,
                  .doc = "factor of the field at nose, mouth and eyes, where the modes predict the "
                         "shape better than the bone"},
        o.at_features);
  visit(FieldInfo{.name = "feature_reach_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 200,
                  .doc = "distance from the features at which the factor reaches 1"},
        o.feature_reach_mm);
}

// The matrix F, points x centres, for which F F' approximates from below the covariance of one
// coordinate of the field (Nystroem projection on the centres):
//   cov(p, q) = alpha(p) alpha(q) (wide^2 exp(-d^2 / 2 wide_length^2) + the same for fine),
// where d = |p - q|, and alpha(p) rises linearly from at_features at a feature to 1 at
// feature_reach_mm from it. centres: indices into points; features: positions, mm.
Eigen::MatrixXd SmoothFieldFactor(std::span<const Vec3> points, std::span<const int> centres,
                                  std::span<const Vec3> features,
                                  const SmoothFieldOptions& options);

}  // namespace semblance::problems
