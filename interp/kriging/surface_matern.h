// SPDX-License-Identifier: GPL-3.0-or-later
// Tissue depth as a Gaussian process along the bone, with a standard deviation.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "interp/dowels/depth_input.h"
#include "interp/dowels/dowel_samples.h"
#include "interp/kriging/depth_mean.h"

namespace semblance::interp {

class ReducedMatern;  // on_surface/matern_field.h

struct SurfaceMatern {
  static constexpr std::string_view kName = "surface_matern";
  int alpha = 2;
  DepthMean mean = DepthMean::kConstant;
  std::optional<double> length_mm = std::nullopt;
  double length_prior_mm = 60;
  double length_prior_spread = 0.5;
  std::optional<double> half_at_relief_mm = std::nullopt;
  std::optional<double> signal_mm = std::nullopt;
  double nugget_share = 1;
  bool fit_nugget = false;
  double edge_mm = 3;
  bool clamp = true;
  bool state_sd = true;
  double max_angle_deg = 90;
};
template <class Visitor>
void Fields(Visitor& visit, SurfaceMatern& o) {
  visit(
      FieldInfo{
          .name = "alpha",
          .min = 1,
          .max = 3,
          .doc =
              "order of the equation (kappa^2 - Laplace)^(alpha/2) f = noise; the field is Matern "
              "with nu = alpha - 1: 2 has a slope nearly everywhere, 3 is smoother; 1 is as rough "
              "as the mesh allows (a spike at each dowel, thinner with a smaller edge_mm)"},
      o.alpha);
  MeanField(visit, o.mean);
  visit(FieldInfo{.name = "length_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 1e4,
                  .doc = "correlation length along the bone, as for kriging; none: by maximum "
                         "likelihood with the prior below"},
        o.length_mm);
  LengthPriorFields(visit, o.length_prior_mm, o.length_prior_spread);
  visit(FieldInfo{.name = "half_at_relief_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 1000,
                  .doc = "makes the length vary: at a place x mm below or above the bone smoothed "
                         "over 40 mm it is length_mm / (1 + x / this), which is shorter in hollows "
                         "and on ridges than on a smooth vault; none: one length everywhere"},
        o.half_at_relief_mm);
  SignalField(visit, o.signal_mm);
  NuggetShareField(visit, o.nugget_share);
  visit(FieldInfo{.name = "fit_nugget",
                  .doc =
                      "fit an additional uncertainty of all dowels (variation between neighbouring "
                      "places) by maximum likelihood; it smooths depths that are not correlated"},
        o.fit_nugget);
  visit(FieldInfo{.name = "edge_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "smallest distance of the vertices on which the process is computed; the "
                         "field is linear between them; finer than a tenth of the length changes "
                         "little and costs time; 0: the skull's own mesh"},
        o.edge_mm);
  ClampField(visit, o.clamp);
  StateSdField(visit, o.state_sd);
  MaxAngleField(visit, o.max_angle_deg);
}

// The process is the Gaussian field of on_surface/matern_field.h, divided by its own standard
// deviation and multiplied by the signal. The division keeps the uncertainty at a rim, on a crest
// and on a small loose piece the same as elsewhere, where the equation alone would increase the
// variance. The covariances are positive definite on any surface, unlike those of geodesic
// distances. With half_at_relief_mm the length varies (WithLengths). Far from all dowels, and on
// pieces of the skull without a dowel, the depth is the mean. sd_mm is the sd of the process at the
// vertex, given the dowels, the model and the uncertain mean. It excludes the nugget of another
// measurement and the uncertainty of length and signal. It is NaN if there are no more dowels than
// factors of the mean and signal_mm is not given. Length and signal, if not given, maximise the
// restricted likelihood times the length's prior, within a factor of 12 of the prior's median
// (FitHyper below); of more than 60 dowels it uses 60 that lie far apart. kNotFacing
// as in AssignWhereFacing. Throws InputError as CheckDepthInput and MeanRegressors do, or if the
// skull has no triangle.
DepthField InterpolateDepth(const SurfaceMatern& options, const DepthInput& input,
                            const RunContext& run);

// The data of a field: n dowels.
struct SurfaceMaternData {
  Eigen::VectorXd depth_mm;    // n
  Eigen::VectorXd nugget_mm2;  // n; variance of each depth, 0 if certain
  Eigen::MatrixXd regressors;  // n x q; regressors of the mean
};

struct SurfaceMaternHyper {
  double length_mm = 1;
  double signal_mm = 1;
  double nugget_mm = 0;
  std::vector<std::string> at_end = {};  // DepthProcess::at_end
};

// The values of kappa^2 at which a search over lengths needs exact correlations: eight over the
// range of lengths, or the one that the options fix.
std::vector<double> SearchPoles(const SurfaceMatern& options);

// The cost to minimise: the restricted deviance of depths with the covariance signal^2 R(length) +
// nugget, where R are the correlations, plus the length's prior. logs: logarithms of length, signal
// and nugget. gradient: may be null.
double SurfaceMaternCost(const SurfaceMatern& options, const SurfaceMaternData& data,
                         const ReducedMatern& correlations, const Eigen::VectorXd& logs,
                         Eigen::VectorXd* gradient);

// Minimises that cost by FindLogs. The length stays within a factor of 12 (e^2.5) of the prior's
// median, the signal within 1/30 to 10 times the depths' spread (or more, see FindLogs), and the
// nugget within 1/100 to 1 times the spread. Values that the options fix are kept. Throws Cancelled
// if stopped.
SurfaceMaternHyper FitHyper(const SurfaceMatern& options, const SurfaceMaternData& data,
                            const ReducedMatern& correlations, const RunContext& run);

}  // namespace semblance::interp
