// SPDX-License-Identifier: GPL-3.0-or-later
// Length and signal of a kriging process by maximum likelihood.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "interp/kriging/bounded_minimum.h"
#include "interp/kriging/kriging_process.h"
#include "surfaces/base/run_context.h"

namespace semblance {

// The words of DepthProcess::at_end for those numbers of a search that are at an end; `names` of
// all.
std::vector<std::string> EndsInWords(std::span<const std::string_view> names,
                                     const SearchRange& bounds, const SmoothCost& cost,
                                     const Eigen::VectorXd& logs);

// As FindMinimum over logarithms of length, signal (and a nugget). Where the signal's range holds
// it back the range is widened and searched again: a long length asks for a signal of many times
// the depths' spread, for only what differs between dowels is seen of it. misfit_mm2(length):
// r'R^-1 r of the depths' residuals r and correlations R without any nugget. With n - q eigenvalues
// the deviance at a length is a sum of log(signal^2 + b) + z^2 / (signal^2 + b) with b >= 0 and the
// sum of z^2 the misfit, so no best signal^2 is above that; the range ends at its fourfold. Widens
// `bounds`.
Eigen::VectorXd FindLogs(SearchRange& bounds, const SmoothCost& cost,
                         const std::function<double(double)>& misfit_mm2, const RunContext& run);

// Whether a process's signal is known: it is given, or depths tell it. As many depths as the mean
// has factors (regressors: n x q) tell nothing but the mean: the restricted likelihood has n - q
// degrees of freedom. Without a signal there is no sd to state.
bool KnowsSignal(const std::optional<double>& signal_mm, const Eigen::MatrixXd& regressors);

// The rms distance of depths from their mean, mm; at least 1e-3.
double DepthSpread(const Eigen::VectorXd& depth_mm);

// What minimises Deviance() plus the length's log-normal prior, within a factor of 20 (e^3) of the
// prior's median and a signal of 1/30 to 10 times the depths' spread, or more where the likelihood
// asks for it (FindLogs): from the best of a coarse grid by Ceres' BFGS with exact derivatives,
// over logarithms that a logistic map keeps within these bounds. What the options fix stays so.
// Throws Cancelled if stopped.
KrigingHyper FitHyper(const Kriging& options, const KrigingData& data, const RunContext& run);

}  // namespace semblance
