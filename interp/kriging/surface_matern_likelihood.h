// SPDX-License-Identifier: GPL-3.0-or-later
// Fits length, signal and nugget of a Matern field on a surface by maximum likelihood.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "interp/kriging/surface_matern.h"
#include "interp/on_surface/matern_field.h"
#include "surfaces/base/run_context.h"

namespace semblance {

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

}  // namespace semblance
