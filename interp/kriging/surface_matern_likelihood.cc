// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/kriging/surface_matern_likelihood.h"

#include <array>
#include <cmath>

#include "interp/kriging/bounded_minimum.h"
#include "interp/kriging/gaussian_regression.h"
#include "interp/kriging/kriging_process.h"

namespace semblance {
namespace {

constexpr double kReach = 2.5;  // range of the length's logarithm on each side of the prior's
                                // median
constexpr int kPoles = 8;

double FittedNugget(const SurfaceMatern& options, const Eigen::VectorXd& logs) {
  return options.fit_nugget ? std::exp(logs[2]) : 0;
}

SurfaceMaternHyper MakeHyper(const SurfaceMatern& options, const Eigen::VectorXd& logs) {
  return {std::exp(logs[0]), std::exp(logs[1]), FittedNugget(options, logs)};
}

// The ranges of the three logarithms.
SearchRange SearchBounds(const SurfaceMatern& options, const SurfaceMaternData& data) {
  const double prior = std::log(options.length_prior_mm);
  const double spread = std::log(DepthSpread(data.depth_mm));
  SearchRange bounds{Vec3(prior - kReach, spread - std::log(30.0), spread - std::log(100.0)),
                     Vec3(prior + kReach, spread + std::log(10.0), spread)};
  if (options.length_mm) {
    bounds.low[0] = bounds.high[0] = std::log(*options.length_mm);
  }
  if (options.signal_mm) {
    bounds.low[1] = bounds.high[1] = std::log(*options.signal_mm);
  }
  if (!options.fit_nugget) {
    bounds.low[2] = bounds.high[2];
  }
  return bounds;
}

}  // namespace

std::vector<double> SearchPoles(const SurfaceMatern& options) {
  const auto pole = [&](double length_mm) {
    const double kappa = MaternKappa(options.alpha, length_mm);
    return kappa * kappa;
  };
  if (options.length_mm) {
    return {pole(*options.length_mm)};
  }
  std::vector<double> poles;
  for (int k = 0; k < kPoles; ++k) {
    const double log = kReach * (2.0 * k / (kPoles - 1) - 1);
    poles.push_back(pole(options.length_prior_mm * std::exp(log)));
  }
  return poles;
}

double SurfaceMaternCost(const SurfaceMatern& options, const SurfaceMaternData& data,
                         const ReducedMatern& correlations, const Eigen::VectorXd& logs,
                         Eigen::VectorXd* gradient) {
  const SurfaceMaternHyper hyper = MakeHyper(options, logs);
  const double variance = hyper.signal_mm * hyper.signal_mm;
  const double nugget = hyper.nugget_mm * hyper.nugget_mm;
  const MaternCorrelations r = correlations.At(options.alpha, hyper.length_mm);
  Eigen::MatrixXd covariance = variance * r.value;
  covariance.diagonal() += (data.nugget_mm2.array() + nugget).matrix();
  const GaussianRegression regression(covariance, variance, data.depth_mm, data.regressors);
  const double away = (logs[0] - std::log(options.length_prior_mm)) / options.length_prior_spread;
  if (gradient != nullptr) {
    const Eigen::Index n = data.depth_mm.size();
    const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(n, n);
    *gradient =
        Vec3(regression.DevianceAlong(variance * r.by_log_length) +
                 2 * away / options.length_prior_spread,
             regression.DevianceAlong(2 * variance * r.value + 2 * regression.added() * one),
             regression.DevianceAlong(2 * nugget * one));
  }
  return regression.Deviance() + away * away;
}

SurfaceMaternHyper FitHyper(const SurfaceMatern& options, const SurfaceMaternData& data,
                            const ReducedMatern& correlations, const RunContext& run) {
  constexpr std::array<std::string_view, 2> kNames = {"length", "signal"};
  const auto cost = [&](const Eigen::VectorXd& logs, Eigen::VectorXd* gradient) {
    return SurfaceMaternCost(options, data, correlations, logs, gradient);
  };
  const auto misfit_mm2 = [&](double length_mm) {
    return GaussianRegression(correlations.At(options.alpha, length_mm).value, 1, data.depth_mm,
                              data.regressors)
        .Misfit();
  };
  SearchRange bounds = SearchBounds(options, data);
  const Eigen::VectorXd logs = FindLogs(bounds, cost, misfit_mm2, run);
  SurfaceMaternHyper hyper = MakeHyper(options, logs);
  // A nugget at its lower bound means no nugget and is not reported.
  hyper.at_end = DescribeRangeEnds(kNames, bounds, cost, logs);
  return hyper;
}

}  // namespace semblance
