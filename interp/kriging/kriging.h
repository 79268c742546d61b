// SPDX-License-Identifier: GPL-3.0-or-later
// Kriging: tissue depth as a Gaussian process in space, with a standard deviation; ordinary where
// its mean is constant, else universal.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "interp/dowels/depth_input.h"
#include "interp/dowels/dowel_samples.h"
#include "interp/kriging/depth_mean.h"
#include "interp/kriging/process_fields.h"
#include "interp/on_surface/surface_distance.h"

namespace semblance {

enum class Covariance { kMatern12, kMatern32, kMatern52, kSquaredExponential };
constexpr auto EnumNames(Covariance) {
  return std::to_array<std::string_view>(
      {"matern_1_2", "matern_3_2", "matern_5_2", "squared_exponential"});
}

struct Kriging {
  static constexpr std::string_view kName = "kriging";
  Covariance covariance = Covariance::kMatern32;       // smoother ones oscillate between far dowels
  DowelDistance distance = DowelDistance::kEuclidean;  // or along the bone
  DepthMean mean = DepthMean::kConstant;               // what the depths vary around
  std::optional<double> length_mm = std::nullopt;      // none: by maximum likelihood
  double length_prior_mm = 60;                         // median; dowels alone do not fix a length
  double length_prior_spread = 0.5;                    // sd of the logarithm
  std::optional<double> signal_mm = std::nullopt;      // none: by maximum likelihood
  double nugget_share = 1;                             // of a dowel's sd_mm; 0 honours every dowel
  bool clamp = true;                                   // to the dowels' range
  bool state_sd = true;                                // sd_mm per vertex
  double max_angle_deg = 90;                           // further turned bone gets no depth
};
template <class Visitor>
void Fields(Visitor& visit, Kriging& o) {
  visit(FieldInfo{.name = "covariance",
                  .doc = "of two depths by the distance between their bases, from rough "
                         "(matern_1_2, an exponential) to very smooth (squared_exponential, which "
                         "oscillates between dowels that are far apart)"},
        o.covariance);
  DistanceField(visit, o.distance);
  MeanField(visit, o.mean);
  visit(FieldInfo{.name = "length_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 1e4,
                  .doc = "distance over which depths resemble each other; none: by maximum "
                         "likelihood with the prior below"},
        o.length_mm);
  LengthPriorFields(visit, o.length_prior_mm, o.length_prior_spread);
  SignalField(visit, o.signal_mm);
  NuggetShareField(visit, o.nugget_share);
  ClampField(visit, o.clamp);
  StateSdField(visit, o.state_sd);
  MaxAngleField(visit, o.max_angle_deg);
}

// The maximum of the restricted likelihood times the prior (kriging_likelihood.h). Of more than 200
// dowels it uses 200 that lie far apart. Throws as InterpolateDepth.
DepthProcess FitKriging(const Kriging& options, const DepthInput& input, const RunContext& run);

// Of the depths at some points, given the dowels, the model and the uncertain mean.
struct DepthPosterior {
  Eigen::VectorXd mean_mm;     // without `clamp`
  Eigen::MatrixXd covariance;  // mm^2, symmetric; its diagonal is the square of the sd_mm below,
                               // but with too few dowels, which state none, of the least signal
};

// By straight distances, also where `options` says along the bone. Throws InputError as
// CheckDepthInput.
DepthPosterior KrigingPosterior(const Kriging& options, const DepthInput& input,
                                std::span<const Vec3> points, const RunContext& run);

// Far from all dowels the depth is the process's mean there. sd_mm is that of the process at the
// vertex, given the dowels, the model and the uncertain mean; it does not hold the nugget of a
// further measurement there, nor the uncertainty of length and signal. It is NaN where none is
// known: everywhere if the dowels are no more than the mean has factors and signal_mm is not given,
// and where the variance along the bone comes out below 0, but at a dowel that the field goes
// through. kNotFacing as AssignWhereFacing; kOutside where no dowel is reached along the bone.
// There the smoother covariances are not always definite; then the field smooths, and may miss
// certain dowels. It keeps 8 bytes per vertex and dowel. Throws InputError as CheckDepthInput, or
// if the skull has no triangle to go along.
DepthField InterpolateDepth(const Kriging& options, const DepthInput& input, const RunContext& run);

}  // namespace semblance
