// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/kriging/bounded_minimum.h"

#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>

#include <cmath>
#include <limits>

namespace semblance::interp {
namespace {

constexpr int kSteps = 8;  // grid cells per number

// The cost as a function of unbounded arguments: each number is low + (high - low) / (1 +
// e^-argument).
class BoundedCost final : public ceres::FirstOrderFunction {
 public:
  BoundedCost(const SearchRange& bounds, const SmoothCost& cost, const RunContext& run)
      : bounds_(bounds), cost_(cost), run_(run) {}

  int NumParameters() const override { return static_cast<int>(bounds_.low.size()); }

  Eigen::VectorXd Numbers(const double* arguments) const {
    return bounds_.low + (bounds_.high - bounds_.low).cwiseProduct(Share(arguments));
  }

  bool Evaluate(const double* arguments, double* value, double* gradient) const override {
    if (run_.stop_token.stop_requested()) {
      return false;
    }
    if (gradient == nullptr) {
      *value = cost_(Numbers(arguments), nullptr);
      return std::isfinite(*value);
    }
    Eigen::VectorXd by_number;
    *value = cost_(Numbers(arguments), &by_number);
    const Eigen::VectorXd share = Share(arguments);
    for (Eigen::Index k = 0; k < share.size(); ++k) {
      gradient[k] = by_number[k] * (bounds_.high[k] - bounds_.low[k]) * share[k] * (1 - share[k]);
    }
    return std::isfinite(*value);
  }

 private:
  Eigen::VectorXd Share(const double* arguments) const {
    const Eigen::Map<const Eigen::ArrayXd> x(arguments, bounds_.low.size());
    return (1 + (-x).exp()).inverse();
  }

  const SearchRange& bounds_;
  const SmoothCost& cost_;
  const RunContext& run_;
};

// The arguments at the center of a grid cell; a fixed number has one cell.
Eigen::VectorXd Middle(const SearchRange& bounds, int cell) {
  Eigen::VectorXd arguments = Eigen::VectorXd::Zero(bounds.low.size());
  for (Eigen::Index k = bounds.low.size(); k-- > 0;) {
    if (bounds.high[k] > bounds.low[k]) {
      const double share = (cell % kSteps + 0.5) / kSteps;
      arguments[k] = std::log(share / (1 - share));
      cell /= kSteps;
    }
  }
  return arguments;
}

Eigen::VectorXd BestOfGrid(const SearchRange& bounds, const BoundedCost& cost) {
  const auto open = (bounds.high.array() > bounds.low.array()).count();
  const int cells = static_cast<int>(std::lround(std::pow(kSteps, static_cast<double>(open))));
  Eigen::VectorXd best = Eigen::VectorXd::Zero(bounds.low.size());
  double least = std::numeric_limits<double>::infinity();
  for (int cell = 0; cell < cells; ++cell) {
    const Eigen::VectorXd arguments = Middle(bounds, cell);
    double value = 0;
    if (cost.Evaluate(arguments.data(), &value, nullptr) && value < least) {
      least = value;
      best = arguments;
    }
  }
  return best;
}

}  // namespace

Eigen::VectorXd FindMinimum(const SearchRange& bounds, const SmoothCost& cost,
                            const RunContext& run) {
  if (bounds.low == bounds.high) {
    return bounds.low;
  }
  auto* bounded = new BoundedCost(bounds, cost, run);
  const ceres::GradientProblem problem(bounded);  // takes ownership
  Eigen::VectorXd arguments = BestOfGrid(bounds, *bounded);
  ceres::GradientProblemSolver::Options how;
  how.line_search_direction_type = ceres::BFGS;
  how.logging_type = ceres::SILENT;
  how.function_tolerance = 1e-16;  // the gradient decides on convergence
  how.gradient_tolerance = 1e-7;
  ceres::GradientProblemSolver::Summary summary;
  ceres::Solve(how, problem, arguments.data(), &summary);
  run.ThrowIfStopped();
  return bounded->Numbers(arguments.data());
}

// At a minimum inside the range the cost has no slope. Near an end that holds the number back, the
// cost still falls outward.
RangeEnd EndOfRange(const SearchRange& bounds, const SmoothCost& cost, const Eigen::VectorXd& x,
                    Eigen::Index number) {
  constexpr double kBeside = 0.1;  // of the range, since the logistic map never reaches the ends
  constexpr double kSlope = 1e-3;  // far above the round-off of a slope at a minimum
  const double range = bounds.high[number] - bounds.low[number];
  if (!(range > 0)) {
    return RangeEnd::kNone;
  }
  Eigen::VectorXd slope;
  cost(x, &slope);
  const double share = (x[number] - bounds.low[number]) / range;
  return share < kBeside && slope[number] > kSlope        ? RangeEnd::kLow
         : share > 1 - kBeside && slope[number] < -kSlope ? RangeEnd::kHigh
                                                          : RangeEnd::kNone;
}

}  // namespace semblance::interp
