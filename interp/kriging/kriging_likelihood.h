// SPDX-License-Identifier: GPL-3.0-or-later
// Length and signal of a kriging process by maximum likelihood.
#pragma once

#include "interp/kriging/kriging_process.h"
#include "surfaces/base/run_context.h"

namespace semblance {

// The rms distance of depths from their mean, mm; at least 1e-3.
double DepthSpread(const Eigen::VectorXd& depth_mm);

// What minimises Deviance() plus the length's log-normal prior, within a factor of 20 (e^3) of the
// prior's median and a signal of 1/30 to 10 times the depths' spread: from the best of a coarse
// grid by Ceres' BFGS with exact derivatives, over logarithms that a logistic map keeps within
// these bounds. What the options fix stays so. Throws Cancelled if stopped.
KrigingHyper FitHyper(const Kriging& options, const KrigingData& data, const RunContext& run);

}  // namespace semblance
