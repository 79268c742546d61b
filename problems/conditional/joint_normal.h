// SPDX-License-Identifier: GPL-3.0-or-later
// Several numbers of a person as one normal distribution over people: what some of them tell of the
// others.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace semblance {

struct JointNormal {
  std::vector<std::string> names;  // n, each once
  Eigen::VectorXd mean, sd;        // n; sd > 0
  Eigen::MatrixXd correlation;     // n x n, positive definite
  std::vector<int> sample;         // n: subjects behind each mean and sd; 0: taken as exact
  double shrinkage = 0;            // 0..1: part of the correlations that is a model's

  std::optional<int> Find(const std::string& name) const;
};

struct KnownValue {
  std::string name;
  double value = 0;
  double error_sd = 0;  // of its own error, >= 0; 0: exact
};

// Of all n numbers, those that are known among them.
struct ConditionalNormal {
  Eigen::VectorXd mean, sd;    // of a number that is known exactly: itself, and 0
  Eigen::MatrixXd covariance;  // without the widening below
};

// The distribution of a person's numbers given some of them: with S the covariance, G the known
// ones, E the variances of their errors and V = S_GG + E,
//   mean = m + S_.G V^-1 (x - m_G),   covariance = S - S_.G V^-1 S_G. .
// Where means and deviations come from n subjects, sd is widened as the prediction of a regression
// is: with k known numbers, of which the part 1 - shrinkage rests on the sample, v = n - 1 - k (1 -
// shrinkage) and q = (x - m_G)' V^-1 (x - m_G),
//   sd^2 = covariance (n - 1) / v (1 + 1 / n + (1 - shrinkage) q / (n - 1)),
// and by Student's quantile at 95 % for v over that of the normal distribution: so the 90 %
// interval is the exact one for a complete sample without shrinkage (Seber & Lee 2003, 5.3). v is
// at least 1. Throws InputError if a known name is not among the names, appears twice, or is not
// finite.
ConditionalNormal Condition(const JointNormal& joint, std::span<const KnownValue> known);

}  // namespace semblance
