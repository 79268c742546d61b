// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/conditional/joint_normal.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <set>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

using Eigen::Index;

std::vector<Index> IndicesOf(const JointNormal& joint, std::span<const KnownValue> known) {
  std::vector<Index> at;
  std::set<int> seen;
  for (const KnownValue& value : known) {
    const std::optional<int> index = joint.Find(value.name);
    if (!index) {
      throw InputError(fmt::format("'{}' is not among what is known over people: {}", value.name,
                                   fmt::join(joint.names, ", ")));
    }
    if (!seen.insert(*index).second) {
      throw InputError(fmt::format("'{}' is given twice; leave one out", value.name));
    }
    if (!std::isfinite(value.value) || !(value.error_sd >= 0)) {
      throw InputError(
          fmt::format("'{}' is {} with an error of {}; both must be finite, and the "
                      "error at least 0",
                      value.name, value.value, value.error_sd));
    }
    at.push_back(*index);
  }
  return at;
}

// How many times the normal distribution's 90 % interval Student's is.
double StudentFactor(double freedom) {
  constexpr double kUpper = 0.95;
  return boost::math::quantile(boost::math::students_t(freedom), kUpper) /
         boost::math::quantile(boost::math::normal(), kUpper);
}

// What a forecast from known numbers owes to the sample behind its factors.
struct OfSample {
  double counted = 0;           // numbers that the sample was asked for
  double squared_distance = 0;  // of what is known from the mean: q of the header
};

// By which a deviation grows, as means, deviations and correlations come from `sample` subjects.
double Widening(int sample, const OfSample& of, double shrinkage) {
  if (sample < 2) {
    return 1;
  }
  const double n = sample, freedom = std::max(1.0, n - 1 - of.counted);
  const double variance =
      (n - 1) / freedom * (1 + 1 / n + (1 - shrinkage) * of.squared_distance / (n - 1));
  return std::sqrt(variance) * StudentFactor(freedom);
}

Eigen::MatrixXd Scaled(const JointNormal& joint, const Eigen::MatrixXd& correlation) {
  return joint.sd.asDiagonal() * correlation * joint.sd.asDiagonal();
}

// Of the covariance S, the part that is the sample's own: without the model's.
Eigen::MatrixXd OfSubjects(const JointNormal& joint, const Eigen::MatrixXd& s) {
  return s - joint.shrinkage * (joint.model.size() > 0 ? Scaled(joint, joint.model) : s);
}

}  // namespace

std::optional<int> JointNormal::Find(const std::string& name) const {
  const auto at = std::ranges::find(names, name);
  return at == names.end() ? std::nullopt : std::optional(static_cast<int>(at - names.begin()));
}

ConditionalNormal Condition(const JointNormal& joint, std::span<const KnownValue> known) {
  const std::vector<Index> at = IndicesOf(joint, known);
  const auto count = static_cast<Index>(known.size());
  const Eigen::MatrixXd s = Scaled(joint, joint.correlation);
  ConditionalNormal result{joint.mean, {}, s};
  Eigen::VectorXd of_errors = Eigen::VectorXd::Zero(joint.mean.size());
  OfSample of;
  if (count > 0) {
    Eigen::VectorXd off(count), errors(count);
    for (Index k = 0; k < count; ++k) {
      off[k] = known[k].value - joint.mean[at[k]];
      errors[k] = known[k].error_sd * known[k].error_sd;
    }
    const Eigen::MatrixXd with = s(Eigen::all, at);
    Eigen::MatrixXd v = s(at, at);
    v.diagonal() += errors;
    const Eigen::LLT<Eigen::MatrixXd> factor(v);
    const Eigen::VectorXd weights = factor.solve(off);
    const Eigen::MatrixXd factors = factor.solve(with.transpose());  // B'
    result.mean += with * weights;
    result.covariance -= with * factors;
    of_errors = factors.cwiseAbs2().transpose() * errors;
    of.squared_distance = off.dot(weights) - errors.dot(weights.cwiseAbs2());
    of.counted = std::max(0.0, factor.solve(OfSubjects(joint, s)(at, at)).trace());
  }
  const Eigen::VectorXd open = (result.covariance.diagonal() - of_errors).cwiseMax(0).cwiseSqrt();
  result.sd.resize(open.size());
  for (Index i = 0; i < open.size(); ++i) {
    result.sd[i] = std::hypot(std::sqrt(of_errors[i]),
                              open[i] * Widening(joint.sample[i], of, joint.shrinkage));
  }
  for (Index k = 0; k < count; ++k) {
    result.sd[at[k]] = std::min(result.sd[at[k]], known[k].error_sd);
    if (known[k].error_sd == 0) {
      result.mean[at[k]] = known[k].value;
    }
  }
  return result;
}

}  // namespace semblance
