// SPDX-License-Identifier: GPL-3.0-or-later
// A joint normal distribution from the numbers of some people, of whom a few may lack some.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "problems/conditional/joint_normal.h"

namespace semblance {

struct JointSample {
  std::vector<std::string> names;  // n
  Eigen::MatrixXd values;          // subjects x n; NaN where not known
};

// The part of the correlations that is to be taken from `target`: what minimises the expected
// squared error of the whole matrix (Schaefer & Strimmer 2005, with a fixed target),
//   sum over pairs of Var(r_ij) / sum of (r_ij - t_ij)^2, within 0.02 .. 1.
// 1 with fewer than four subjects that have a pair of numbers.
double ShrinkageOf(const JointSample& sample, const Eigen::MatrixXd& target);

// Mean, sd (with n - 1) and correlations by expectation and maximisation, numbers that are missing
// taken as missing at random (Little & Rubin 2002, 11.2); of complete samples they are the sample's
// own. The correlations are (1 - shrinkage) those of the sample + shrinkage `target`.
//   target: n x n, a positive definite correlation. shrinkage: none for ShrinkageOf; above 0 where
//   there are no more subjects than numbers, else the result is not positive definite.
// Throws InputError if a number has fewer than two subjects, or is the same for all of them.
JointNormal FitJointNormal(const JointSample& sample, const Eigen::MatrixXd& target,
                           std::optional<double> shrinkage = std::nullopt);

}  // namespace semblance
