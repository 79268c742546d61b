// SPDX-License-Identifier: GPL-3.0-or-later
// Length, signal and nugget of a Matern field on a surface by maximum likelihood.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "interp/kriging/surface_matern.h"
#include "interp/on_surface/reduced_matern.h"
#include "surfaces/base/run_context.h"

namespace semblance {

// What a field is conditioned on: n dowels.
struct SurfaceMaternData {
  Eigen::VectorXd depth_mm;    // n
  Eigen::VectorXd nugget_mm2;  // n: variance of each depth; 0: certain
  Eigen::MatrixXd regressors;  // n x q: what the mean is linear in
};

struct SurfaceMaternHyper {
  double length_mm = 1;
  double signal_mm = 1;
  double nugget_mm = 0;
  std::vector<std::string> at_end = {};  // DepthProcess::at_end
};

// The values of kappa^2 at which correlations are to be known for a search over lengths: eight over
// the lengths that are searched, or the one that the options fix.
std::vector<double> SearchPoles(const SurfaceMatern& options);

// The cost that is minimised: the restricted deviance of depths with covariance signal^2 R(length)
// + nugget, R the correlations, plus the length's prior. logs: of length, signal and nugget.
// gradient: may be null.
double SurfaceMaternCost(const SurfaceMatern& options, const SurfaceMaternData& data,
                         const ReducedMatern& correlations, const Eigen::VectorXd& logs,
                         Eigen::VectorXd* gradient);

// The least of that cost within a factor of 12 (e^2.5) of the prior's median, a signal of 1/30 to
// 10 times the depths' spread, or more where the likelihood asks for it (FindLogs), and a nugget of
// 1/100 to 1 times the spread. What the options fix stays so. Throws Cancelled if stopped.
SurfaceMaternHyper FitHyper(const SurfaceMatern& options, const SurfaceMaternData& data,
                            const ReducedMatern& correlations, const RunContext& run);

}  // namespace semblance
