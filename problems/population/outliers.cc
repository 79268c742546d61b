// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/outliers.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "surfaces/base/quantile.h"

namespace semblance {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNormalFactor = 1.4826;  // of the median absolute deviation

// (value - median) / robust deviation of the finite ones; NaN elsewhere, and for too few.
std::vector<double> RobustZ(const std::vector<double>& values, double least_deviation) {
  std::vector<double> there, off;
  for (const double value : values) {
    if (std::isfinite(value)) {
      there.push_back(value);
    }
  }
  std::vector<double> z(values.size(), kNaN);
  if (std::ssize(there) < kFewestForOutliers) {
    return z;
  }
  const double median = Quantile(there, 0.5);
  for (const double value : there) {
    off.push_back(std::abs(value - median));
  }
  const double deviation = std::max(kNormalFactor * Quantile(off, 0.5), least_deviation);
  for (std::size_t k = 0; k < values.size(); ++k) {
    z[k] = (values[k] - median) / deviation;
  }
  return z;
}

// Columns of the sample as the joint distribution has them.
std::vector<Index> ColumnsOf(const JointSample& sample, const JointNormal& joint) {
  std::vector<Index> columns;
  for (const std::string& name : joint.names) {
    columns.push_back(std::ranges::find(sample.names, name) - sample.names.begin());
  }
  return columns;
}

// Each number less what the others of its subject let expect, subjects x names of the joint; with P
// the inverse covariance of those that the subject has, P (x - m) over P's diagonal.
MatrixXd Surprises(const MatrixXd& values, const JointNormal& joint) {
  const MatrixXd s = joint.sd.asDiagonal() * joint.correlation * joint.sd.asDiagonal();
  MatrixXd surprises = MatrixXd::Constant(values.rows(), values.cols(), kNaN);
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
    const VectorXd alone = (precision * off).cwiseQuotient(precision.diagonal());
    for (std::size_t k = 0; k < at.size(); ++k) {
      surprises(row, at[k]) = alone[static_cast<Index>(k)];
    }
  }
  return surprises;
}

std::vector<double> Column(const MatrixXd& matrix, Index j) {
  return {matrix.col(j).begin(), matrix.col(j).end()};
}

// Per subject, over its sites; NaN without any.
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
  constexpr double kLeast_mm = 0.2, kLeastLog = 0.1;
  const MatrixXd values = sample.values(Eigen::all, ColumnsOf(sample, joint));
  const MatrixXd surprises = Surprises(values, joint);
  MatrixXd unlike = MatrixXd::Constant(values.rows(), values.cols(), kNaN);
  std::vector<Outlier> outliers;
  for (Index j = 0; j < values.cols(); ++j) {
    if (!IsSite(joint.names[j])) {
      continue;
    }
    const std::vector<double> z = RobustZ(Column(surprises, j), kLeast_mm);
    const std::vector<double> off = RobustZ(Column(values, j), kLeast_mm);
    for (Index row = 0; row < values.rows(); ++row) {
      unlike(row, j) = off[row];
      if (std::abs(z[row]) > options.site_z) {
        outliers.push_back({.subject = static_cast<int>(row),
                            .site = joint.names[j],
                            .depth_mm = values(row, j),
                            .expected_mm = values(row, j) - surprises(row, j),
                            .z = z[row]});
      }
    }
  }
  std::ranges::stable_sort(outliers, {}, &Outlier::subject);
  const std::vector<double> whole = RobustZ(LogRms(unlike), kLeastLog);
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

}  // namespace semblance
