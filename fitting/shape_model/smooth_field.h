// SPDX-License-Identifier: GPL-3.0-or-later
// A smooth random displacement of a shape, for what its modes cannot express: a Gaussian process
// over the mean shape (Luethi et al. 2018), of low rank.
#pragma once

#include <Eigen/Core>
#include <span>

#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"

namespace semblance {

struct SmoothFieldOptions {
  int centres = 110;             // points that span the field; 0: no field
  double wide_sd_mm = 2;         // of its wide part
  double wide_length_mm = 45;    // over which that resembles itself
  double fine_sd_mm = 1;         // of its fine part
  double fine_length_mm = 20;    // over which that resembles itself
  double at_features = 0.5;      // factor at nose, mouth and eyes
  double feature_reach_mm = 15;  // where the factor has risen to 1
};
template <class Visitor>
void Fields(Visitor& visit, SmoothFieldOptions& o) {
  visit(FieldInfo{.name = "centres",
                  .min = 0,
                  .max = 1000,
                  .doc = "points that span the field, each with three coordinates; more follow "
                         "smaller details; 0: no field, the modes alone"},
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
                  .doc = "length over which the wide part resembles itself"},
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
                  .doc = "length over which the fine part resembles itself"},
        o.fine_length_mm);
  visit(FieldInfo{.name = "at_features",
                  .min = 0,
                  .max = 1,
                  .doc = "factor of the field at nose, mouth and eyes, where the modes know more "
                         "than the bone does"},
        o.at_features);
  visit(FieldInfo{.name = "feature_reach_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 200,
                  .doc = "distance from the features at which that factor has risen to 1"},
        o.feature_reach_mm);
}

// F, points x centres, such that F F' is nearly, and never more than, the covariance of one
// coordinate of the field:
//   cov(p, q) = alpha(p) alpha(q) (wide^2 exp(-d^2 / 2 wide_length^2) + fine^2 exp(..)), d = |p -
//   q|, alpha(p) = at_features at a feature, rising in proportion to 1 at feature_reach_mm from it.
// The projection on the centres (Nystroem). centres: indices into points; features: positions, mm.
Eigen::MatrixXd SmoothFieldFactor(std::span<const Vec3> points, std::span<const int> centres,
                                  std::span<const Vec3> features,
                                  const SmoothFieldOptions& options);

}  // namespace semblance
