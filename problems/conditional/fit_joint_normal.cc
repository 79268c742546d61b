// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/conditional/fit_joint_normal.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLeastShrinkage = 0.02;  // keeps the matrix well conditioned
constexpr int kMostRounds = 500;
constexpr double kSettled = 1e-10;

// A sample whose numbers have mean 0 and sd 1 over those who have them.
struct Standardised {
  MatrixXd values;  // NaN where not known
  VectorXd mean, sd;
  std::vector<int> counts;
};

Standardised Standardise(const JointSample& sample) {
  const Index names = sample.values.cols();
  Standardised z{sample.values, VectorXd(names), VectorXd(names), {}};
  for (Index j = 0; j < names; ++j) {
    double sum = 0, squares = 0;
    int count = 0;
    for (const double x : sample.values.col(j)) {
      sum += std::isfinite(x) ? x : 0;
      count += std::isfinite(x) ? 1 : 0;
    }
    z.mean[j] = sum / count;
    for (const double x : sample.values.col(j)) {
      squares += std::isfinite(x) ? std::pow(x - z.mean[j], 2) : 0;
    }
    z.sd[j] = std::sqrt(squares / (count - 1));
    if (count < 2 || !(z.sd[j] > 1e-12 * std::max(1.0, std::abs(z.mean[j])))) {
      throw InputError(fmt::format(
          "'{}': {} subjects have it, and they must be two at least that differ; leave it out",
          sample.names[j], count));
    }
    z.values.col(j) = (sample.values.col(j).array() - z.mean[j]) / z.sd[j];
    z.counts.push_back(count);
  }
  return z;
}

struct Pair {
  int subjects = 0;
  double correlation = 0, variance = 0;  // of the estimate
};

// Over the subjects that have both, of standardised numbers.
Pair PairOf(const MatrixXd& z, Index i, Index j) {
  std::vector<double> products;
  for (Index k = 0; k < z.rows(); ++k) {
    if (std::isfinite(z(k, i)) && std::isfinite(z(k, j))) {
      products.push_back(z(k, i) * z(k, j));
    }
  }
  const double n = static_cast<double>(products.size());
  double mean = 0, squares = 0;
  for (const double w : products) {
    mean += w / n;
  }
  for (const double w : products) {
    squares += (w - mean) * (w - mean);
  }
  return {static_cast<int>(products.size()), n / (n - 1) * mean, n / std::pow(n - 1, 3) * squares};
}

double ShrinkageOf(const MatrixXd& z, const MatrixXd& target) {
  constexpr int kFewest = 4;
  double variance = 0, distance = 0;
  for (Index i = 0; i < z.cols(); ++i) {
    for (Index j = 0; j < i; ++j) {
      const Pair pair = PairOf(z, i, j);
      if (pair.subjects >= kFewest) {
        variance += pair.variance;
        distance += std::pow(pair.correlation - target(i, j), 2);
      }
    }
  }
  return variance < distance ? std::max(kLeastShrinkage, variance / distance) : 1;
}

std::vector<Index> Where(const Eigen::RowVectorXd& row, bool known) {
  std::vector<Index> at;
  for (Index j = 0; j < row.size(); ++j) {
    if (std::isfinite(row[j]) == known) {
      at.push_back(j);
    }
  }
  return at;
}

struct Moments {
  VectorXd mean;
  MatrixXd covariance;
};

// The numbers that a subject lacks as they are expected from those that it has; adds what that
// leaves open to `open`.
Eigen::RowVectorXd Completed(Eigen::RowVectorXd row, const Moments& now, MatrixXd& open) {
  const std::vector<Index> known = Where(row, true), missing = Where(row, false);
  if (missing.empty()) {
    return row;
  }
  if (known.empty()) {
    open += now.covariance;
    return now.mean.transpose();
  }
  const MatrixXd across = now.covariance(missing, known);
  const Eigen::LLT<MatrixXd> factor(now.covariance(known, known));
  const VectorXd off = row(known).transpose() - now.mean(known);
  const VectorXd predicted = now.mean(missing) + across * factor.solve(off);
  const MatrixXd left =
      now.covariance(missing, missing) - across * factor.solve(across.transpose());
  for (std::size_t a = 0; a < missing.size(); ++a) {
    row[missing[a]] = predicted[static_cast<Index>(a)];
    for (std::size_t b = 0; b < missing.size(); ++b) {
      open(missing[a], missing[b]) += left(static_cast<Index>(a), static_cast<Index>(b));
    }
  }
  return row;
}

// One round of expectation and maximisation; the correlations are then shrunk.
Moments Improved(const MatrixXd& z, const Moments& now, const MatrixXd& target, double shrinkage) {
  MatrixXd open = MatrixXd::Zero(z.cols(), z.cols()), full(z.rows(), z.cols());
  for (Index k = 0; k < z.rows(); ++k) {
    full.row(k) = Completed(z.row(k), now, open);
  }
  Moments next{full.colwise().mean().transpose(), {}};
  const MatrixXd off = full.rowwise() - next.mean.transpose();
  next.covariance = (off.transpose() * off + open) / static_cast<double>(z.rows() - 1);
  const VectorXd sd = next.covariance.diagonal().cwiseSqrt();
  const MatrixXd wanted = sd.asDiagonal() * target * sd.asDiagonal();
  next.covariance = (1 - shrinkage) * next.covariance + shrinkage * wanted;
  return next;
}

Moments MomentsOf(const MatrixXd& z, const MatrixXd& target, double shrinkage) {
  Moments now{VectorXd::Zero(z.cols()), target};
  for (int round = 0; round < kMostRounds; ++round) {
    Moments next = Improved(z, now, target, shrinkage);
    const double change = std::max((next.covariance - now.covariance).cwiseAbs().maxCoeff(),
                                   (next.mean - now.mean).cwiseAbs().maxCoeff());
    now = std::move(next);
    if (change < kSettled) {
      break;
    }
  }
  return now;
}

}  // namespace

double ShrinkageOf(const JointSample& sample, const MatrixXd& target) {
  return ShrinkageOf(Standardise(sample).values, target);
}

JointNormal FitJointNormal(const JointSample& sample, const MatrixXd& target,
                           std::optional<double> shrinkage) {
  const Standardised z = Standardise(sample);
  JointNormal joint{.names = sample.names,
                    .mean = {},
                    .sd = {},
                    .correlation = {},
                    .sample = z.counts,
                    .shrinkage = shrinkage ? *shrinkage : ShrinkageOf(z.values, target),
                    .model = target};
  const Moments moments = MomentsOf(z.values, target, joint.shrinkage);
  const VectorXd sd = moments.covariance.diagonal().cwiseSqrt();
  const VectorXd inverse = sd.cwiseInverse();
  joint.mean = z.mean + z.sd.cwiseProduct(moments.mean);
  joint.sd = z.sd.cwiseProduct(sd);
  joint.correlation = inverse.asDiagonal() * moments.covariance * inverse.asDiagonal();
  joint.correlation.diagonal().setOnes();
  return joint;
}

}  // namespace semblance
