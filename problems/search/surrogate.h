// SPDX-License-Identifier: GPL-3.0-or-later
// A Gaussian process of a cost over the codes of a search.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "interp/kriging/gaussian_regression.h"
#include "surfaces/base/run_context.h"

namespace semblance {

// Costs that are known: n codes of d numbers, a column each.
struct KnownCosts {
  Eigen::MatrixXd codes;          // d x n
  Eigen::VectorXd costs;          // n, finite
  std::vector<int> axes_of_code;  // d: those of one axis share a length
};

// Matern 5/2 with a length for each axis, a constant mean and a nugget.
struct SurrogateHyper {
  Eigen::VectorXd log_lengths;  // one per axis
  double log_nugget = 0;        // of its share of the process's variance
};

// The maximum of the restricted likelihood over the lengths, whose prior is log-normal with the
// median 0.5 and a spread of e, and the nugget, 1e-6 to 1 of the variance: first with one length
// for all, then of each axis in turn.
SurrogateHyper FitSurrogate(const KnownCosts& known, const RunContext& run);

struct ExpectedCost {
  double mean = 0, sd = 0;
};

class Surrogate {
 public:
  Surrogate(KnownCosts known, SurrogateHyper hyper);
  ExpectedCost At(const Eigen::VectorXd& code) const;

 private:
  KnownCosts known_;
  SurrogateHyper hyper_;
  double variance_ = 0;
  std::unique_ptr<GaussianRegression> regression_;
};

// How much below `best` the cost is on average, where it is below at all and else not counted
// (Jones, Schonlau & Welch 1998, eq. 15).
double ExpectedImprovement(const ExpectedCost& cost, double best);

}  // namespace semblance
