// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/kriging/kriging_likelihood.h"

#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace semblance {
namespace {

constexpr double kFlatDepths_mm = 1e-3;  // depths that spread less than this are one depth

double DepthSpread(const Eigen::VectorXd& depth_mm) {
  const double mean = depth_mm.mean();
  return std::max(std::sqrt((depth_mm.array() - mean).square().mean()), kFlatDepths_mm);
}

// The two logarithms that are searched, each within bounds; equal bounds hold it fixed.
struct Search {
  Vec2 low, high;

  Search(const Kriging& options, const KrigingData& data) {
    const double prior = std::log(options.length_prior_mm);
    const double spread = DepthSpread(data.depth_mm);
    low = {prior - 3, std::log(spread / 30)};
    high = {prior + 3, std::log(spread * 10)};
    if (options.length_mm) {
      low[0] = high[0] = std::log(*options.length_mm);
    }
    if (options.signal_mm) {
      low[1] = high[1] = std::log(*options.signal_mm);
    }
  }
};

KrigingHyper HyperOf(const Vec2& logs) { return {std::exp(logs[0]), std::exp(logs[1])}; }

// What is to be least, of the two logarithms.
struct Cost {
  const Kriging& options;
  const KrigingData& data;

  double Away(const Vec2& logs) const {
    return (logs[0] - std::log(options.length_prior_mm)) / options.length_prior_spread;
  }
  double At(const Vec2& logs) const {
    const KrigingProcess process(options.covariance, data, HyperOf(logs));
    return process.Deviance() + Away(logs) * Away(logs);
  }
  double At(const Vec2& logs, Vec2& gradient) const {
    const KrigingProcess process(options.covariance, data, HyperOf(logs));
    gradient = process.DevianceGradient();
    gradient[0] += 2 * Away(logs) / options.length_prior_spread;
    return process.Deviance() + Away(logs) * Away(logs);
  }
};

// The cost over the whole plane: each logarithm is low + (high - low) / (1 + e^-x).
class BoundedCost final : public ceres::FirstOrderFunction {
 public:
  BoundedCost(const Cost& cost, const Search& search, const RunContext& run)
      : cost_(cost), search_(search), run_(run) {}

  int NumParameters() const override { return 2; }

  Vec2 LogsOf(const double* x) const {
    return search_.low + (search_.high - search_.low).cwiseProduct(Share(x));
  }

  bool Evaluate(const double* x, double* value, double* gradient) const override {
    if (run_.stop_token.stop_requested()) {
      return false;
    }
    if (!gradient) {
      *value = cost_.At(LogsOf(x));
      return std::isfinite(*value);
    }
    Vec2 by_logs;
    *value = cost_.At(LogsOf(x), by_logs);
    const Vec2 share = Share(x);
    for (int k = 0; k < 2; ++k) {
      gradient[k] = by_logs[k] * (search_.high[k] - search_.low[k]) * share[k] * (1 - share[k]);
    }
    return std::isfinite(*value);
  }

 private:
  static Vec2 Share(const double* x) {
    return {1 / (1 + std::exp(-x[0])), 1 / (1 + std::exp(-x[1]))};
  }

  const Cost& cost_;
  const Search& search_;
  const RunContext& run_;
};

// The best of the middles of a grid's cells, as the logistic map's arguments.
Vec2 BestOfGrid(const Search& search, const BoundedCost& cost) {
  constexpr int kSteps = 8;
  const auto argument = [](int k) {
    const double share = (k + 0.5) / kSteps;
    return std::log(share / (1 - share));
  };
  Vec2 best = Vec2::Zero();
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < (search.high[0] > search.low[0] ? kSteps : 1); ++i) {
    for (int j = 0; j < (search.high[1] > search.low[1] ? kSteps : 1); ++j) {
      const Vec2 x(argument(i), argument(j));
      double value = 0;
      if (cost.Evaluate(x.data(), &value, nullptr) && value < least) {
        least = value;
        best = x;
      }
    }
  }
  return best;
}

}  // namespace

KrigingHyper FitHyper(const Kriging& options, const KrigingData& data, const RunContext& run) {
  if (options.length_mm && options.signal_mm) {
    return {*options.length_mm, *options.signal_mm};
  }
  const Search search(options, data);
  const Cost cost{options, data};
  auto* bounded = new BoundedCost(cost, search, run);
  const ceres::GradientProblem problem(bounded);  // owns it
  Vec2 x = BestOfGrid(search, *bounded);
  ceres::GradientProblemSolver::Options how;
  how.line_search_direction_type = ceres::BFGS;
  how.logging_type = ceres::SILENT;
  how.function_tolerance = 1e-12;
  how.gradient_tolerance = 1e-7;
  ceres::GradientProblemSolver::Summary summary;
  ceres::Solve(how, problem, x.data(), &summary);
  run.ThrowIfStopped();
  return HyperOf(bounded->LogsOf(x.data()));
}

}  // namespace semblance
