// SPDX-License-Identifier: GPL-3.0-or-later
// Kriging: tissue depth as a Gaussian process in space, with a standard deviation. A constant mean
// gives ordinary kriging, other means universal kriging.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "interp/dowels/depth_input.h"
#include "interp/dowels/dowel_samples.h"
#include "interp/kriging/depth_mean.h"
#include "interp/on_surface/surface_distance.h"

namespace semblance::interp {

enum class Covariance { kMatern12, kMatern32, kMatern52, kSquaredExponential };
constexpr auto EnumNames(Covariance) {
  return std::to_array<std::string_view>(
      {"matern_1_2", "matern_3_2", "matern_5_2", "squared_exponential"});
}

struct Kriging {
  static constexpr std::string_view kName = "kriging";
  Covariance covariance = Covariance::kMatern32;
  DowelDistance distance = DowelDistance::kEuclidean;
  DepthMean mean = DepthMean::kConstant;
  std::optional<double> length_mm = std::nullopt;
  double length_prior_mm = 60;
  double length_prior_spread = 0.5;
  std::optional<double> signal_mm = std::nullopt;
  double nugget_share = 1;
  bool clamp = true;
  bool state_sd = true;
  double max_angle_deg = 90;
};
template <class Visitor>
void Fields(Visitor& visit, Kriging& o) {
  visit(FieldInfo{.name = "covariance",
                  .doc = "covariance of two depths by the distance of their bases, from rough "
                         "(matern_1_2, an exponential) to very smooth (squared_exponential, which "
                         "oscillates between distant dowels)"},
        o.covariance);
  DistanceField(visit, o.distance);
  MeanField(visit, o.mean);
  visit(
      FieldInfo{
          .name = "length_mm",
          .unit = "mm",
          .min = 1,
          .max = 1e4,
          .doc =
              "correlation length of the depths; none: by maximum likelihood with the prior below"},
      o.length_mm);
  LengthPriorFields(visit, o.length_prior_mm, o.length_prior_spread);
  SignalField(visit, o.signal_mm);
  NuggetShareField(visit, o.nugget_share);
  ClampField(visit, o.clamp);
  StateSdField(visit, o.state_sd);
  MaxAngleField(visit, o.max_angle_deg);
}

// Maximises the restricted likelihood times the prior (FitHyper in kriging_process.h). It uses at
// most 200 dowels, which lie far apart. Throws as InterpolateDepth does.
DepthProcess FitKriging(const Kriging& options, const DepthInput& input, const RunContext& run);

// The distribution of the depths at some points, given the dowels, the model and the uncertain
// mean.
struct DepthPosterior {
  Eigen::VectorXd mean_mm;     // without `clamp`
  Eigen::MatrixXd covariance;  // mm^2, symmetric; its diagonal is sd_mm^2 of InterpolateDepth (with
                               // too few dowels for an sd, that of the smallest signal)
};

// Computes the distribution with straight distances, also if `options` has geodesic distances.
// Throws InputError as CheckDepthInput does.
DepthPosterior KrigingPosterior(const Kriging& options, const DepthInput& input,
                                std::span<const Vec3> points, const RunContext& run);

// Far from all dowels the depth is the process's mean. sd_mm is the sd of the process at the
// vertex, given the dowels, the model and the uncertain mean. It excludes the nugget of another
// measurement at the vertex and the uncertainty of length and signal. It is NaN everywhere if there
// are no more dowels than factors of the mean and signal_mm is not given. Geodesic distances:
// vertices from which no dowel is reached along the bone get kOutside. The smoother covariances are
// not always positive definite; then the field smooths and may miss certain dowels, and sd_mm is
// NaN where the variance is negative (except at an interpolated dowel). Needs 8 bytes per vertex
// and dowel. kNotFacing as in AssignWhereFacing. Throws InputError as CheckDepthInput does, or if
// geodesic distances are requested and the skull has no triangle.
DepthField InterpolateDepth(const Kriging& options, const DepthInput& input, const RunContext& run);

}  // namespace semblance::interp
