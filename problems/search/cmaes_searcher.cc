// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/search/cmaes_searcher.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "problems/search/best_first.h"

namespace semblance {

CmaEsSearcher::CmaEsSearcher(const CmaEsSearch& options, SearchSpace space,
                             const SearchBudget& budget)
    : space_(std::move(space)),
      random_(budget.random_seed),
      left_(budget.full_runs),
      sigma_(options.sigma) {
  const Eigen::Index size = std::ssize(AxesOfCode(space_));
  const auto n = static_cast<double>(size);
  lambda_ = options.population.value_or(4 + static_cast<int>(3 * std::log(n)));
  const int mu = lambda_ / 2;
  weights_.resize(mu);
  for (int i = 0; i < mu; ++i) {
    weights_[i] = std::log((lambda_ + 1) / 2.0) - std::log(i + 1.0);
  }
  weights_ /= weights_.sum();
  mu_eff_ = 1 / weights_.squaredNorm();
  c_sigma_ = (mu_eff_ + 2) / (n + mu_eff_ + 5);
  d_sigma_ = 1 + 2 * std::max(0.0, std::sqrt((mu_eff_ - 1) / (n + 1)) - 1) + c_sigma_;
  c_c_ = (4 + mu_eff_ / n) / (n + 4 + 2 * mu_eff_ / n);
  c_1_ = 2 / (std::pow(n + 1.3, 2) + mu_eff_);
  c_mu_ = std::min(1 - c_1_, 2 * (mu_eff_ - 2 + 1 / mu_eff_) / (std::pow(n + 2, 2) + mu_eff_));
  mean_length_ = std::sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n));
  mean_ = Eigen::VectorXd::Constant(size, 0.5);
  path_sigma_ = path_c_ = Eigen::VectorXd::Zero(size);
  covariance_ = Eigen::MatrixXd::Identity(size, size);
  Decompose();
}

std::vector<SearchAsk> CmaEsSearcher::Ask() {
  std::vector<SearchAsk> asks;
  steps_.clear();
  for (int k = std::min(lambda_, left_); k > 0; --k, --left_) {
    Eigen::VectorXd draw(mean_.size());
    for (double& x : draw) {
      x = random_.Normal();
    }
    steps_.push_back(axes_ * lengths_.cwiseProduct(draw));
    asks.push_back({Decode(space_, mean_ + sigma_ * steps_.back())});
  }
  return asks;
}

void CmaEsSearcher::Tell(std::span<const double> costs) {
  if (static_cast<int>(costs.size()) < lambda_) {
    return;
  }
  const std::vector<std::size_t> order = BestFirst(costs);
  Eigen::VectorXd step = Eigen::VectorXd::Zero(mean_.size());
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    step += weights_[i] * steps_[order[static_cast<std::size_t>(i)]];
  }
  mean_ += sigma_ * step;
  ++generation_;
  MovePaths(step);
  Learn(order);
}

void CmaEsSearcher::Decompose() {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance_);
  axes_ = eigen.eigenvectors();
  lengths_ = eigen.eigenvalues().cwiseMax(1e-20).cwiseSqrt();
}

// Eq. 43 and 45 of the tutorial.
void CmaEsSearcher::MovePaths(const Eigen::VectorXd& step) {
  const Eigen::VectorXd white =
      axes_ * lengths_.cwiseInverse().cwiseProduct(axes_.transpose() * step);
  path_sigma_ =
      (1 - c_sigma_) * path_sigma_ + std::sqrt(c_sigma_ * (2 - c_sigma_) * mu_eff_) * white;
  const double settled = std::sqrt(1 - std::pow(1 - c_sigma_, 2 * generation_));
  const auto n = static_cast<double>(mean_.size());
  const bool is_short = path_sigma_.norm() / settled < (1.4 + 2 / (n + 1)) * mean_length_;
  path_c_ = (1 - c_c_) * path_c_;
  if (is_short) {
    path_c_ += std::sqrt(c_c_ * (2 - c_c_) * mu_eff_) * step;
  }
  // Eq. 47, with what a stalled path leaves out of the variance.
  const double missing = is_short ? 0 : c_1_ * c_c_ * (2 - c_c_);
  covariance_ *= 1 - c_1_ - c_mu_ + missing;
}

void CmaEsSearcher::Learn(std::span<const std::size_t> order) {
  covariance_ += c_1_ * path_c_ * path_c_.transpose();
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    const Eigen::VectorXd& y = steps_[order[static_cast<std::size_t>(i)]];
    covariance_ += c_mu_ * weights_[i] * y * y.transpose();
  }
  // Eq. 44. A cloud far wider than the cube would only be folded back into it.
  sigma_ = std::min(
      1.0, sigma_ * std::exp(c_sigma_ / d_sigma_ * (path_sigma_.norm() / mean_length_ - 1)));
  Decompose();
}

}  // namespace semblance
