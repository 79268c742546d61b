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
  Eigen::MatrixXd model = {};      // n x n: that model's; empty: as `correlation`

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
// ones, E the variances of their errors, V = S_GG + E and B = S_.G V^-1,
//   mean = m + B (x - m_G),   covariance = S - B S_G. .
// Of the covariance's diagonal the part N = diag(B E B') is what the errors bring; their variance
// is given. The rest is what the regression on the numbers themselves leaves open. Where means and
// deviations come from n subjects, the rest is widened as the prediction of a regression is: with
// q = w' S_GG w, w = V^-1 (x - m_G), and v = n - 1 - k,
//   sd^2 = N + (covariance - N) (n - 1) / v (1 + 1 / n + (1 - shrinkage) q / (n - 1)) t^2,
// t Student's quantile at 95 % for v over that of the normal distribution. k counts the numbers
// that the sample was asked for as ridge regression does: the trace of V^-1 (S_GG - M_GG), M the
// shrinkage times the model's covariance (Hastie, Tibshirani & Friedman 2009, 3.4.1). A number that
// is known exactly counts 1 without shrinkage, one with a huge error 0. So the 90 % interval is the
// exact one for a complete sample without shrinkage or errors (Seber & Lee 2003, 5.3), and what
// tells nothing changes nothing. v is at least 1. No known number's sd is above its error's. Throws
// InputError if a known name is not among the names, appears twice, or is not finite.
ConditionalNormal Condition(const JointNormal& joint, std::span<const KnownValue> known);

}  // namespace semblance
