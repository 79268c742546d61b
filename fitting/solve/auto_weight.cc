// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/solve/auto_weight.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "fitting/least_squares/cross_validation.h"
#include "fitting/least_squares/sparse_factor.h"
#include "surfaces/base/error.h"

namespace semblance::fitting {
namespace {

// Probes of the trace's estimate: time against accuracy. The decade needs a rough score only.
constexpr int kProbes = 32, kRoughProbes = 8;

class WeightSearch {
 public:
  // probes: number of probes if the trace is estimated.
  WeightSearch(const WeightProblem& problem, int probes)
      : problem_(problem), probes_(problem.points.lower.rows(), probes) {
    influenced_ = problem.points.lower.selfadjointView<Eigen::Lower>() * probes_.directions();
  }

  // NaN scores are never the best.
  WeightChoice Try(double weight) {
    const auto [at, added] = tried_.try_emplace(weight);
    if (added) {
      at->second = At(weight);
    }
    if (at->second.score < best_.score || std::isnan(best_.score)) {
      best_ = at->second;
    }
    return at->second;
  }
  const WeightChoice& best() const { return best_; }

 private:
  WeightChoice At(double weight) const {
    SparseMatrix lower = problem_.points.lower + weight * problem_.smooth.lower;
    Eigen::MatrixX3d right = problem_.points.right + weight * problem_.smooth.right;
    if (problem_.fixed.lower.rows() > 0) {
      lower += problem_.fixed.lower;
      right += problem_.fixed.right;
    }
    const double mean = lower.diagonal().mean();
    const SparseFactor factor(lower, 1e-11 * std::max(mean, 1e-300));
    if (!factor.usable()) {
      return {};
    }
    const Eigen::MatrixXd step = factor.Solve(right);
    const double misfit =
        problem_.misfit - 2 * step.cwiseProduct(problem_.points.right).sum() +
        step.cwiseProduct(problem_.points.lower.selfadjointView<Eigen::Lower>() * step).sum();
    const double trace = probes_.Estimate(factor.Solve(influenced_));
    return {.weight = weight,
            .score = CrossValidationScore(misfit, trace, problem_.count),
            .degrees_of_freedom = trace};
  }

  const WeightProblem& problem_;
  TraceProbes probes_;
  Eigen::MatrixXd influenced_;
  std::map<double, WeightChoice> tried_;
  WeightChoice best_;
};

// Finds the best decade, from smooth to rough. It stops after two scores that clearly exceed the
// best one, because rougher weights cost more time and cannot be better.
double BestDecade(const WeightProblem& problem, double near) {
  constexpr double kTurned = 1.05;  // exceeds the errors of the rough scores
  WeightSearch search(problem, kRoughProbes);
  const double even = problem.points.lower.diagonal().sum() /
                      std::max(problem.smooth.lower.diagonal().sum(), 1e-300);
  int turned = 0;
  for (int decade = near > 0 ? 1 : 4; decade >= (near > 0 ? -1 : -10) && turned < 2; --decade) {
    const double score = search.Try((near > 0 ? near : even) * std::pow(10.0, decade)).score;
    turned = score > kTurned * search.best().score ? turned + 1 : 0;
  }
  return search.best().weight;
}

// Returns the largest weight whose score is within 1 % of the best. The score is flat there, and in
// gaps without points a rougher surface oscillates.
WeightChoice SmoothestNearBest(WeightSearch& search) {
  constexpr double kScoreRatio = 1.01;  // larger: smoother gaps, but a worse fit to the points
  WeightChoice choice = search.best();
  for (int k = 0; k < 12; ++k) {
    const WeightChoice next = search.Try(choice.weight * std::sqrt(std::sqrt(10.0)));
    if (!(next.score <= kScoreRatio * search.best().score)) {
      break;
    }
    choice = next;
  }
  return choice;
}

}  // namespace

WeightChoice ChooseWeight(const WeightProblem& problem, double near) {
  const double decade = BestDecade(problem, near);
  if (std::isnan(decade)) {
    return {};
  }
  WeightSearch search(problem, kProbes);
  search.Try(decade);
  for (const double factor : {std::sqrt(10.0), std::sqrt(std::sqrt(10.0))}) {
    const double middle = search.best().weight;
    search.Try(middle * factor);
    search.Try(middle / factor);
  }
  return SmoothestNearBest(search);
}

int AutoTerm(std::span<const Term> terms) {
  int found = -1;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const bool automatic = std::visit(
        []<class T>(const T& t) {
          if constexpr (std::is_same_v<decltype(t.weight), AutoOr<double>>) {
            return t.weight.automatic;
          }
          return false;
        },
        terms[k]);
    if (automatic && found >= 0) {
      throw InputError(
          fmt::format("the terms '{}' and '{}' both have weight: auto; give one of them a number",
                      TermName(terms[found]), TermName(terms[k])));
    }
    found = automatic ? static_cast<int>(k) : found;
  }
  return found;
}

double PointWeight(std::span<const Term> terms) {
  double sum = 0;
  for (const Term& term : terms) {
    sum += std::holds_alternative<PointTerm>(term) ? TermWeight(term) : 0;
  }
  return sum;
}

double WeightAsWritten(std::span<const Term> terms, double length_mm) {
  return PointWeight(terms) / std::pow(length_mm, 4);
}

void SetWeight(double weight, Term& term) {
  std::visit(
      [&]<class T>(T& t) {
        if constexpr (std::is_same_v<decltype(t.weight), AutoOr<double>>) {
          t.weight = weight;
        }
      },
      term);
}

}  // namespace semblance::fitting
