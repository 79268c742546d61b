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

// By which a deviation grows, as means, deviations and correlations come from `sample` subjects.
double Widening(int sample, double counted, double squared_distance, double shrinkage) {
  if (sample < 2) {
    return 1;
  }
  const double n = sample, freedom = std::max(1.0, n - 1 - counted);
  const double variance =
      (n - 1) / freedom * (1 + 1 / n + (1 - shrinkage) * squared_distance / (n - 1));
  return std::sqrt(variance) * StudentFactor(freedom);
}

}  // namespace

std::optional<int> JointNormal::Find(const std::string& name) const {
  const auto at = std::ranges::find(names, name);
  return at == names.end() ? std::nullopt : std::optional(static_cast<int>(at - names.begin()));
}

ConditionalNormal Condition(const JointNormal& joint, std::span<const KnownValue> known) {
  const std::vector<Index> at = IndicesOf(joint, known);
  const auto count = static_cast<Index>(known.size());
  Eigen::MatrixXd s = joint.sd.asDiagonal() * joint.correlation * joint.sd.asDiagonal();
  ConditionalNormal result{joint.mean, {}, s};
  double squared_distance = 0;
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
    squared_distance = off.dot(factor.solve(off));
    result.mean += with * factor.solve(off);
    result.covariance -= with * factor.solve(with.transpose());
  }
  const double counted = static_cast<double>(count) * (1 - joint.shrinkage);
  result.sd = result.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  for (Index i = 0; i < result.sd.size(); ++i) {
    result.sd[i] *= Widening(joint.sample[i], counted, squared_distance, joint.shrinkage);
  }
  for (Index k = 0; k < count; ++k) {
    if (known[k].error_sd == 0) {
      result.mean[at[k]] = known[k].value;
      result.sd[at[k]] = 0;
    }
  }
  return result;
}

}  // namespace semblance
