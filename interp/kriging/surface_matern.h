// SPDX-License-Identifier: GPL-3.0-or-later
// Tissue depth as a Gaussian process along the bone, with a standard deviation.
#pragma once

#include <optional>
#include <string_view>

#include "interp/dowels/depth_input.h"
#include "interp/dowels/dowel_samples.h"
#include "interp/kriging/depth_mean.h"
#include "interp/kriging/process_fields.h"

namespace semblance {

struct SurfaceMatern {
  static constexpr std::string_view kName = "surface_matern";
  int alpha = 2;                                   // smoothness nu = alpha - 1
  DepthMean mean = DepthMean::kConstant;           // what the depths vary around
  std::optional<double> length_mm = std::nullopt;  // none: by maximum likelihood
  double length_prior_mm = 60;                     // median; dowels alone do not fix a length
  double length_prior_spread = 0.5;                // sd of the logarithm
  std::optional<double> half_at_relief_mm = std::nullopt;  // none: one length everywhere
  std::optional<double> signal_mm = std::nullopt;          // none: by maximum likelihood
  double nugget_share = 1;    // of a dowel's sd_mm; 0 honours every dowel
  bool fit_nugget = false;    // one more nugget, by maximum likelihood
  double edge_mm = 3;         // of the mesh that the process is found on
  bool clamp = true;          // to the dowels' range
  bool state_sd = true;       // sd_mm per vertex
  double max_angle_deg = 90;  // further turned bone gets no depth
};
template <class Visitor>
void Fields(Visitor& visit, SurfaceMatern& o) {
  visit(FieldInfo{.name = "alpha",
                  .min = 1,
                  .max = 3,
                  .doc = "order of the equation (kappa^2 - Laplace)^(alpha/2) f = noise; the field "
                         "is Matern with nu = alpha - 1: 2 has a slope nearly everywhere, 3 is "
                         "smoother; 1 is as rough as the mesh lets it be (a spike at each dowel, "
                         "thinner with a smaller edge_mm)"},
        o.alpha);
  MeanField(visit, o.mean);
  visit(FieldInfo{.name = "length_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 1e4,
                  .doc = "distance along the bone over which depths resemble each other, as "
                         "kriging's; none: by maximum likelihood with the prior below"},
        o.length_mm);
  LengthPriorFields(visit, o.length_prior_mm, o.length_prior_spread);
  visit(FieldInfo{.name = "half_at_relief_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 1000,
                  .doc = "a length that varies: at a place that lies x mm below or above the bone "
                         "smoothed over 40 mm it is 1 / (1 + x / this) of length_mm, so shorter "
                         "in hollows and on ridges than on a smooth vault; none: one length "
                         "everywhere"},
        o.half_at_relief_mm);
  SignalField(visit, o.signal_mm);
  NuggetShareField(visit, o.nugget_share);
  visit(FieldInfo{.name = "fit_nugget",
                  .doc = "let the likelihood find one more uncertainty that all dowels have (what "
                         "varies between neighbouring places): it smooths where depths are not "
                         "correlated"},
        o.fit_nugget);
  visit(
      FieldInfo{.name = "edge_mm",
                .unit = "mm",
                .min = 0,
                .max = 50,
                .doc = "least distance of the vertices that the process is found on; between "
                       "them the field is linear; finer than a tenth of the length changes little "
                       "and costs time; 0: the skull's own mesh"},
      o.edge_mm);
  ClampField(visit, o.clamp);
  StateSdField(visit, o.state_sd);
  MaxAngleField(visit, o.max_angle_deg);
}

// The Gaussian field of on_surface/matern_field.h, divided by its own standard deviation and times
// the signal: as uncertain at a rim, on a crest and on a small loose piece as elsewhere, for the
// equation alone would have the variance grow there; so kernels are positive definite on any
// surface, which those of geodesic distances are not. With half_at_relief_mm that is the field of a
// length which varies (WithLengths). Far from all dowels, and on pieces of the
// skull without one, the depth is the mean there. sd_mm is that of the process at the vertex, given
// the dowels, the model and the uncertain mean; it does not hold the nugget of a further
// measurement there, nor the uncertainty of length and signal. It is NaN if the dowels are no more
// than the mean has factors and signal_mm is not given. Length and signal, where they are not
// given, are the maximum of the restricted likelihood times the length's prior, within a factor of
// 12 of the prior's median (surface_matern_likelihood.h); of more than 60 dowels it uses 60 that
// lie far apart. kNotFacing as AssignWhereFacing. Throws InputError as CheckDepthInput and
// MeanRegressors, or if the skull has no triangle.
DepthField InterpolateDepth(const SurfaceMatern& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance
