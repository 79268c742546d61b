// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "problems/search/search_ask.h"
#include "problems/search/search_method.h"

namespace semblance {

// The (mu/mu_w, lambda) CMA-ES as in Hansen 2016, figure 6 and table 1, with positive weights
// alone. It draws codes: those outside the unit cube stand for their mirror image within, and a
// choice is the one whose indicator was drawn largest. What could not be run ranks last. A
// generation that the budget cuts short is the last and teaches nothing.
class CmaEsSearcher {
 public:
  CmaEsSearcher(const CmaEsSearch& options, SearchSpace space, const SearchBudget& budget);
  std::vector<SearchAsk> Ask();
  void Tell(std::span<const double> costs);

 private:
  void Decompose();
  void MovePaths(const Eigen::VectorXd& step);
  void Learn(std::span<const std::size_t> order);

  SearchSpace space_;
  Random random_;
  int left_;
  int lambda_;
  Eigen::VectorXd weights_;  // mu, falling, of sum 1
  double mu_eff_ = 0;
  double c_sigma_ = 0, d_sigma_ = 0, c_c_ = 0, c_1_ = 0, c_mu_ = 0;
  double mean_length_ = 0;  // of a normal vector with unit covariance
  int generation_ = 0;
  double sigma_;
  Eigen::VectorXd mean_, path_sigma_, path_c_;
  Eigen::MatrixXd covariance_, axes_;   // C = B D^2 B'; axes_ is B
  Eigen::VectorXd lengths_;             // D
  std::vector<Eigen::VectorXd> steps_;  // (x - mean) / sigma of the draws at hand
};

}  // namespace semblance
