// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/search/surrogate.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "interp/kriging/bounded_minimum.h"
#include "interp/kriging/kriging_process.h"

namespace semblance {
namespace {

const double kMedianLogLength = std::log(0.5);
const SearchRange kLogLength{.low = Eigen::VectorXd::Constant(1, std::log(0.05)),
                             .high = Eigen::VectorXd::Constant(1, std::log(10.0))};
const SearchRange kLogNugget{.low = Eigen::VectorXd::Constant(1, std::log(1e-6)),
                             .high = Eigen::VectorXd::Constant(1, 0.0)};

// The squared parts of a distance that each axis has in it, in lengths.
Eigen::VectorXd SquaredParts(const KnownCosts& known, const SurrogateHyper& hyper,
                             const Eigen::VectorXd& difference) {
  Eigen::VectorXd parts = Eigen::VectorXd::Zero(hyper.log_lengths.size());
  for (Eigen::Index d = 0; d < difference.size(); ++d) {
    const int axis = known.axes_of_code[static_cast<std::size_t>(d)];
    parts[axis] += std::pow(difference[d] / std::exp(hyper.log_lengths[axis]), 2);
  }
  return parts;
}

CorrelationValue Correlation(double squared) {
  return CorrelationAt(Covariance::kMatern52, std::sqrt(squared), 1);
}

Eigen::MatrixXd CovarianceOf(const KnownCosts& known, const SurrogateHyper& hyper) {
  const Eigen::Index n = known.costs.size();
  Eigen::MatrixXd covariance(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      covariance(i, j) = covariance(j, i) =
          Correlation(SquaredParts(known, hyper, known.codes.col(i) - known.codes.col(j)).sum())
              .value;
    }
    covariance(i, i) += std::exp(hyper.log_nugget);
  }
  return covariance;
}

// What the covariance changes by as the logarithm of an axis's length grows.
Eigen::MatrixXd AlongLength(const KnownCosts& known, const SurrogateHyper& hyper,
                            Eigen::Index axis) {
  const Eigen::Index n = known.costs.size();
  Eigen::MatrixXd change = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const Eigen::VectorXd parts =
          SquaredParts(known, hyper, known.codes.col(i) - known.codes.col(j));
      const double all = parts.sum();
      change(i, j) = change(j, i) =
          all > 0 ? Correlation(all).by_log_length * parts[axis] / all : 0;
    }
  }
  return change;
}

GaussianRegression RegressionOf(const KnownCosts& known, const SurrogateHyper& hyper) {
  return {CovarianceOf(known, hyper), 1, known.costs, Eigen::MatrixXd::Ones(known.costs.size(), 1)};
}

// r'V^-1 r.
double Misfit(const KnownCosts& known, const GaussianRegression& regression) {
  return std::max(
      (known.costs.array() - regression.coefficients()[0]).matrix().dot(regression.weights()),
      1e-300);
}

// Minus twice the logarithm of likelihood and prior, with the variance that fits best.
struct Cost {
  double value = 0;
  Eigen::VectorXd by_log_length;
  double by_log_nugget = 0;
};

Cost CostOf(const KnownCosts& known, const SurrogateHyper& hyper, bool with_gradient) {
  const GaussianRegression regression = RegressionOf(known, hyper);
  const auto freedom = static_cast<double>(known.costs.size() - 1);
  const double misfit = Misfit(known, regression);
  const Eigen::VectorXd off = hyper.log_lengths.array() - kMedianLogLength;
  Cost cost{.value = regression.Deviance() - misfit + freedom * std::log(misfit / freedom) +
                     off.squaredNorm(),
            .by_log_length = {},
            .by_log_nugget = 0};
  if (!with_gradient) {
    return cost;
  }
  const Eigen::VectorXd& w = regression.weights();
  const auto along = [&](const Eigen::MatrixXd& change) {
    return regression.DevianceAlong(change) + (1 - freedom / misfit) * w.dot(change * w);
  };
  cost.by_log_length = 2 * off;
  for (Eigen::Index axis = 0; axis < off.size(); ++axis) {
    cost.by_log_length[axis] += along(AlongLength(known, hyper, axis));
  }
  cost.by_log_nugget =
      along(std::exp(hyper.log_nugget) * Eigen::MatrixXd::Identity(w.size(), w.size()));
  return cost;
}

// One length for all axes, and the nugget.
SurrogateHyper FitTogether(const KnownCosts& known, Eigen::Index axes, const RunContext& run) {
  SearchRange range{.low = Eigen::VectorXd(2), .high = Eigen::VectorXd(2)};
  range.low << kLogLength.low[0], kLogNugget.low[0];
  range.high << kLogLength.high[0], kLogNugget.high[0];
  const auto hyper_at = [axes](const Eigen::VectorXd& x) {
    return SurrogateHyper{Eigen::VectorXd::Constant(axes, x[0]), x[1]};
  };
  const Eigen::VectorXd best = FindMinimum(
      range,
      [&](const Eigen::VectorXd& x, Eigen::VectorXd* gradient) {
        const Cost cost = CostOf(known, hyper_at(x), gradient != nullptr);
        if (gradient) {
          *gradient = Eigen::Vector2d(cost.by_log_length.sum(), cost.by_log_nugget);
        }
        return cost.value;
      },
      run);
  return hyper_at(best);
}

}  // namespace

SurrogateHyper FitSurrogate(const KnownCosts& known, const RunContext& run) {
  const Eigen::Index axes =
      1 + *std::max_element(known.axes_of_code.begin(), known.axes_of_code.end());
  SurrogateHyper hyper = FitTogether(known, axes, run);
  for (Eigen::Index axis = 0; axes > 1 && axis < axes; ++axis) {
    const auto hyper_at = [&](const Eigen::VectorXd& x) {
      SurrogateHyper at = hyper;
      at.log_lengths[axis] = x[0];
      return at;
    };
    hyper = hyper_at(FindMinimum(
        kLogLength,
        [&](const Eigen::VectorXd& x, Eigen::VectorXd* gradient) {
          const Cost cost = CostOf(known, hyper_at(x), gradient != nullptr);
          if (gradient) {
            *gradient = cost.by_log_length.segment(axis, 1);
          }
          return cost.value;
        },
        run));
  }
  return hyper;
}

Surrogate::Surrogate(KnownCosts known, SurrogateHyper hyper)
    : known_(std::move(known)),
      hyper_(std::move(hyper)),
      regression_(std::make_unique<GaussianRegression>(RegressionOf(known_, hyper_))) {
  variance_ = Misfit(known_, *regression_) / static_cast<double>(known_.costs.size() - 1);
  regression_->PrepareVariance();
}

ExpectedCost Surrogate::At(const Eigen::VectorXd& code) const {
  Eigen::VectorXd with(known_.costs.size());
  for (Eigen::Index i = 0; i < with.size(); ++i) {
    with[i] = Correlation(SquaredParts(known_, hyper_, known_.codes.col(i) - code).sum()).value;
  }
  const double variance = regression_->Variance(with, Eigen::VectorXd::Ones(1), 1);
  return {.mean = regression_->coefficients()[0] + with.dot(regression_->weights()),
          .sd = std::sqrt(variance_ * std::max(variance, 0.0))};
}

double ExpectedImprovement(const ExpectedCost& cost, double best) {
  if (!(cost.sd > 0)) {
    return std::max(best - cost.mean, 0.0);
  }
  const double z = (best - cost.mean) / cost.sd;
  const double below = 0.5 * std::erfc(-z / std::numbers::sqrt2);
  const double density = std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi);
  return (best - cost.mean) * below + cost.sd * density;
}

}  // namespace semblance
