// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/outliers.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "problems/subject/sites.h"
#include "surfaces/base/quantile.h"

namespace semblance::problems {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The sd of a normal distribution divided by its median absolute deviation.
constexpr double kNormalFactor = 1.4826;

// (value - median) / robust deviation of the finite values; NaN elsewhere, and for too few values.
std::vector<double> RobustZ(const std::vector<double>& values, double min_deviation) {
  std::vector<double> there, off;
  for (const double value : values) {
    if (std::isfinite(value)) {
      there.push_back(value);
    }
  }
  std::vector<double> z(values.size(), kNaN);
  if (std::ssize(there) < kMinSubjectsForOutliers) {
    return z;
  }
  const double median = Quantile(there, 0.5);
  for (const double value : there) {
    off.push_back(std::abs(value - median));
  }
  const double deviation = std::max(kNormalFactor * Quantile(off, 0.5), min_deviation);
  for (std::size_t k = 0; k < values.size(); ++k) {
    z[k] = (values[k] - median) / deviation;
  }
  return z;
}

// The columns of the sample in the order of the joint distribution.
std::vector<Index> FindColumns(const JointSample& sample, const JointNormal& joint) {
  std::vector<Index> columns;
  for (const std::string& name : joint.names) {
    columns.push_back(std::ranges::find(sample.names, name) - sample.names.begin());
  }
  return columns;
}

// Each number minus its expectation given the other numbers of its subject, subjects x names of the
// joint. With P the inverse covariance of the numbers that the subject has, this is P (x - m)
// divided by P's diagonal.
MatrixXd Residuals(const MatrixXd& values, const JointNormal& joint) {
  const MatrixXd s = joint.sd.asDiagonal() * joint.correlation * joint.sd.asDiagonal();
  MatrixXd residuals = MatrixXd::Constant(values.rows(), values.cols(), kNaN);
  for (Index row = 0; row < values.rows(); ++row) {
    std::vector<Index> at;
    for (Index j = 0; j < values.cols(); ++j) {
      if (std::isfinite(values(row, j))) {
        at.push_back(j);
      }
    }
    if (at.empty()) {
      continue;
    }
    const MatrixXd precision =
        s(at, at).llt().solve(MatrixXd::Identity(std::ssize(at), std::ssize(at)));
    const VectorXd off = values.row(row)(at).transpose() - joint.mean(at);
    const VectorXd residual = (precision * off).cwiseQuotient(precision.diagonal());
    for (std::size_t k = 0; k < at.size(); ++k) {
      residuals(row, at[k]) = residual[static_cast<Index>(k)];
    }
  }
  return residuals;
}

std::vector<double> Column(const MatrixXd& matrix, Index j) {
  return {matrix.col(j).begin(), matrix.col(j).end()};
}

// The logarithm of the root mean square of each row's finite values; NaN without any.
std::vector<double> LogRms(const MatrixXd& z) {
  std::vector<double> logs;
  for (const auto row : z.rowwise()) {
    double squares = 0;
    int count = 0;
    for (const double value : row) {
      squares += std::isfinite(value) ? value * value : 0;
      count += std::isfinite(value) ? 1 : 0;
    }
    logs.push_back(count > 0 && squares > 0 ? std::log(squares / count) / 2 : kNaN);
  }
  return logs;
}

}  // namespace

std::vector<Outlier> FindOutliers(const JointSample& sample, const JointNormal& joint,
                                  const OutlierOptions& options) {
  constexpr double kMinDeviation_mm = 0.2, kMinLogDeviation = 0.1;
  const MatrixXd values = sample.values(Eigen::all, FindColumns(sample, joint));
  const MatrixXd residuals = Residuals(values, joint);
  MatrixXd scaled = MatrixXd::Constant(values.rows(), values.cols(), kNaN);
  std::vector<Outlier> outliers;
  for (Index j = 0; j < values.cols(); ++j) {
    if (!IsSite(joint.names[j])) {
      continue;
    }
    const std::vector<double> z = RobustZ(Column(residuals, j), kMinDeviation_mm);
    const std::vector<double> off = RobustZ(Column(values, j), kMinDeviation_mm);
    for (Index row = 0; row < values.rows(); ++row) {
      scaled(row, j) = off[row];
      if (std::abs(z[row]) > options.site_z) {
        outliers.push_back({.subject = static_cast<int>(row),
                            .site = joint.names[j],
                            .depth_mm = values(row, j),
                            .expected_mm = values(row, j) - residuals(row, j),
                            .z = z[row]});
      }
    }
  }
  std::ranges::stable_sort(outliers, {}, &Outlier::subject);
  const std::vector<double> whole = RobustZ(LogRms(scaled), kMinLogDeviation);
  for (std::size_t row = 0; row < whole.size(); ++row) {
    if (whole[row] > options.subject_z) {
      outliers.push_back({.subject = static_cast<int>(row), .site = {}, .z = whole[row]});
    }
  }
  return outliers;
}

JointSample WithoutOutliers(JointSample sample, const std::vector<Outlier>& outliers) {
  for (const Outlier& outlier : outliers) {
    if (outlier.site.empty()) {
      sample.values.row(outlier.subject).setConstant(kNaN);
    } else {
      const auto at = std::ranges::find(sample.names, outlier.site);
      sample.values(outlier.subject, at - sample.names.begin()) = kNaN;
    }
  }
  return sample;
}

}  // namespace semblance::problems
