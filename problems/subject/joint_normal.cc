// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/joint_normal.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <set>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

using Eigen::Index;

std::vector<Index> FindIndices(const JointNormal& joint, std::span<const KnownValue> known) {
  std::vector<Index> at;
  std::set<int> seen;
  for (const KnownValue& value : known) {
    const std::optional<int> index = joint.Find(value.name);
    if (!index) {
      throw InputError(fmt::format("'{}' is not among the numbers of the distribution: {}",
                                   value.name, fmt::join(joint.names, ", ")));
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

// The width of Student's 90 % interval relative to that of the normal distribution.
double StudentFactor(double freedom) {
  constexpr double kUpper = 0.95;
  return boost::math::quantile(boost::math::students_t(freedom), kUpper) /
         boost::math::quantile(boost::math::normal(), kUpper);
}

// The quantities of the header by which the finite sample widens a prediction.
struct SampleTerms {
  double regressors = 0;        // k, the effective number of regressors
  double squared_distance = 0;  // q, of the known numbers from the mean
};

// The factor of a deviation, because means, deviations and correlations come from `sample`
// subjects.
double Widening(int sample, const SampleTerms& terms, double shrinkage) {
  if (sample < 2) {
    return 1;
  }
  const double n = sample, freedom = std::max(1.0, n - 1 - terms.regressors);
  const double variance =
      (n - 1) / freedom * (1 + 1 / n + (1 - shrinkage) * terms.squared_distance / (n - 1));
  return std::sqrt(variance) * StudentFactor(freedom);
}

Eigen::MatrixXd ToCovariance(const JointNormal& joint, const Eigen::MatrixXd& correlation) {
  return joint.sd.asDiagonal() * correlation * joint.sd.asDiagonal();
}

// The part of the covariance S that comes from the sample and not from the model.
Eigen::MatrixXd SamplePart(const JointNormal& joint, const Eigen::MatrixXd& s) {
  return s - joint.shrinkage * (joint.model.size() > 0 ? ToCovariance(joint, joint.model) : s);
}

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMinShrinkage = 0.02;  // keeps the matrix well conditioned
constexpr int kMaxRounds = 500;
constexpr double kTolerance = 1e-10;  // change of standardised moments at which EM ends

// A sample whose numbers have mean 0 and sd 1 over the subjects that have them.
struct Standardised {
  MatrixXd values;  // NaN if not known
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
          "'{}': {} subjects have it; at least two that differ are needed; leave it out",
          sample.names[j], count));
    }
    z.values.col(j) = (sample.values.col(j).array() - z.mean[j]) / z.sd[j];
    z.counts.push_back(count);
  }
  return z;
}

struct PairCorrelation {
  int subjects = 0;
  double correlation = 0;
  double variance = 0;  // of the estimated correlation
};

// The correlation of two standardised numbers over the subjects that have both.
PairCorrelation CorrelatePair(const MatrixXd& z, Index i, Index j) {
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

double ComputeShrinkage(const MatrixXd& z, const MatrixXd& target) {
  constexpr int kMinSubjects = 4;
  double variance = 0, distance = 0;
  for (Index i = 0; i < z.cols(); ++i) {
    for (Index j = 0; j < i; ++j) {
      const PairCorrelation pair = CorrelatePair(z, i, j);
      if (pair.subjects >= kMinSubjects) {
        variance += pair.variance;
        distance += std::pow(pair.correlation - target(i, j), 2);
      }
    }
  }
  return variance < distance ? std::max(kMinShrinkage, variance / distance) : 1;
}

// The columns in which the row is known, or in which it is not.
std::vector<Index> FindColumns(const Eigen::RowVectorXd& row, bool known) {
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

// Replaces the numbers that a subject lacks by their expectation given the others, and adds their
// conditional covariance to `open`.
Eigen::RowVectorXd Completed(Eigen::RowVectorXd row, const Moments& now, MatrixXd& open) {
  const std::vector<Index> known = FindColumns(row, true), missing = FindColumns(row, false);
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

// One round of EM; afterwards the correlations are shrunk.
Moments ImproveMoments(const MatrixXd& z, const Moments& now, const MatrixXd& target,
                       double shrinkage) {
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

Moments EstimateMoments(const MatrixXd& z, const MatrixXd& target, double shrinkage) {
  Moments now{VectorXd::Zero(z.cols()), target};
  for (int round = 0; round < kMaxRounds; ++round) {
    Moments next = ImproveMoments(z, now, target, shrinkage);
    const double change = std::max((next.covariance - now.covariance).cwiseAbs().maxCoeff(),
                                   (next.mean - now.mean).cwiseAbs().maxCoeff());
    now = std::move(next);
    if (change < kTolerance) {
      break;
    }
  }
  return now;
}

}  // namespace

std::optional<int> JointNormal::Find(const std::string& name) const {
  const auto at = std::ranges::find(names, name);
  return at == names.end() ? std::nullopt : std::optional(static_cast<int>(at - names.begin()));
}

ConditionalNormal Condition(const JointNormal& joint, std::span<const KnownValue> known) {
  const std::vector<Index> at = FindIndices(joint, known);
  const auto count = static_cast<Index>(known.size());
  const Eigen::MatrixXd s = ToCovariance(joint, joint.correlation);
  ConditionalNormal result{joint.mean, {}, s};
  Eigen::VectorXd of_errors = Eigen::VectorXd::Zero(joint.mean.size());
  SampleTerms terms;
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
    terms.squared_distance = off.dot(weights) - errors.dot(weights.cwiseAbs2());
    terms.regressors = std::max(0.0, factor.solve(SamplePart(joint, s)(at, at)).trace());
  }
  const Eigen::VectorXd open = (result.covariance.diagonal() - of_errors).cwiseMax(0).cwiseSqrt();
  result.sd.resize(open.size());
  for (Index i = 0; i < open.size(); ++i) {
    result.sd[i] = std::hypot(std::sqrt(of_errors[i]),
                              open[i] * Widening(joint.sample[i], terms, joint.shrinkage));
  }
  for (Index k = 0; k < count; ++k) {
    result.sd[at[k]] = std::min(result.sd[at[k]], known[k].error_sd);
    if (known[k].error_sd == 0) {
      result.mean[at[k]] = known[k].value;
    }
  }
  return result;
}

double ComputeShrinkage(const JointSample& sample, const MatrixXd& target) {
  return ComputeShrinkage(Standardise(sample).values, target);
}

JointNormal FitJointNormal(const JointSample& sample, const MatrixXd& target,
                           std::optional<double> shrinkage) {
  const Standardised z = Standardise(sample);
  JointNormal joint{.names = sample.names,
                    .mean = {},
                    .sd = {},
                    .correlation = {},
                    .sample = z.counts,
                    .shrinkage = shrinkage ? *shrinkage : ComputeShrinkage(z.values, target),
                    .model = target};
  const Moments moments = EstimateMoments(z.values, target, joint.shrinkage);
  const VectorXd sd = moments.covariance.diagonal().cwiseSqrt();
  const VectorXd inverse = sd.cwiseInverse();
  joint.mean = z.mean + z.sd.cwiseProduct(moments.mean);
  joint.sd = z.sd.cwiseProduct(sd);
  joint.correlation = inverse.asDiagonal() * moments.covariance * inverse.asDiagonal();
  joint.correlation.diagonal().setOnes();
  return joint;
}

}  // namespace semblance::problems
