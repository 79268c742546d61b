// SPDX-License-Identifier: GPL-3.0-or-later
// A joint normal distribution of several numbers of a person: its estimate from a sample of people,
// of whom some may lack some numbers, and the distribution of the other numbers given some of them.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace semblance::problems {

struct JointNormal {
  std::vector<std::string> names;  // n, each once
  Eigen::VectorXd mean, sd;        // n; sd > 0
  Eigen::MatrixXd correlation;     // n x n, positive definite
  std::vector<int> sample;         // n; subjects behind each mean and sd; 0: taken as exact
  double shrinkage = 0;            // 0..1; part of the correlations that comes from a model
  Eigen::MatrixXd model = {};      // n x n; the model's correlations; empty: equal to `correlation`

  std::optional<int> Find(const std::string& name) const;
};

struct KnownValue {
  std::string name;
  double value = 0;
  double error_sd = 0;  // standard deviation of its error, >= 0; 0: exact
};

// The distribution of all n numbers, including the known ones.
struct ConditionalNormal {
  Eigen::VectorXd mean, sd;    // a number that is known exactly has its value, and sd 0
  Eigen::MatrixXd covariance;  // without the widening below
};

// The distribution of a person's numbers given some of them. Let m be the mean, S the covariance,
// G the known numbers, x their values, E the variances of their errors, V = S_GG + E and
// B = S_.G V^-1. Then
//   mean = m + B (x - m_G),   covariance = S - B S_G. .
//
// The sd allows for the sample behind means and deviations. On the covariance's diagonal, the part
// N = diag(B E B') comes from the errors, whose variance is given. The rest is the residual of the
// regression on the numbers themselves. If means and deviations come from n subjects, the rest is
// widened as the prediction of a regression is. With q = w' S_GG w, w = V^-1 (x - m_G) and
// v = n - 1 - k (at least 1),
//   sd^2 = N + (covariance - N) (n - 1) / v (1 + 1 / n + (1 - shrinkage) q / (n - 1)) t^2,
// where t is Student's 95 % quantile for v degrees of freedom over that of the normal distribution.
// k is the effective number of regressors, as in ridge regression: the trace of V^-1 (S_GG - M_GG),
// where M is the shrinkage times the model's covariance (Hastie, Tibshirani & Friedman
// 2009, 3.4.1). A number that is known exactly counts 1 without shrinkage; a number with a huge
// error counts 0. The 90 % interval is therefore exact for a complete sample without shrinkage or
// errors (Seber & Lee 2003, 5.3), and a known number without information changes nothing. The sd of
// a known number is never above that of its error.
//
// Throws InputError if a known name is not among the names, appears twice, or is not finite.
ConditionalNormal Condition(const JointNormal& joint, std::span<const KnownValue> known);

struct JointSample {
  std::vector<std::string> names;  // n
  Eigen::MatrixXd values;          // subjects x n; NaN if not known
};

// The shrinkage towards `target` that minimises the expected squared error of the correlation
// matrix (Schaefer & Strimmer 2005, with a fixed target):
//   sum over pairs of Var(r_ij) / sum over pairs of (r_ij - t_ij)^2, within 0.02 .. 1.
// A pair counts if at least four subjects have both numbers; without such a pair the result is 1.
double ComputeShrinkage(const JointSample& sample, const Eigen::MatrixXd& target);

// Estimates mean, sd (with n - 1) and correlations by the EM algorithm. Missing numbers are taken
// as missing at random (Little & Rubin 2002, 11.2). For a complete sample, mean and sd are the
// sample's own. The correlations are (1 - shrinkage) times those of the sample plus shrinkage times
// `target`.
//   target: n x n, a positive definite correlation matrix.
//   shrinkage: nothing means ComputeShrinkage. It must be above 0 if there are no more subjects
//   than numbers; otherwise the result is not positive definite.
// Throws InputError if a number has fewer than two subjects, or is the same for all of them.
JointNormal FitJointNormal(const JointSample& sample, const Eigen::MatrixXd& target,
                           std::optional<double> shrinkage = std::nullopt);

}  // namespace semblance::problems
