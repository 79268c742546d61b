// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/thin_plate.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "surfaces/base/error.h"

namespace semblance::surfaces {
namespace {

using Eigen::MatrixXd;
using Rows3 = Eigen::MatrixX3d;

[[noreturn]] void Fail(const std::string& what) { throw InputError("thin plate: " + what); }

void CheckPoints(std::span<const Vec3> from, std::span<const Vec3> to,
                 std::span<const double> weights, const ThinPlateOptions& options) {
  if (from.size() != to.size() || (!weights.empty() && weights.size() != from.size())) {
    Fail(fmt::format("{} points, {} to carry them to and {} weights; give as many of each",
                     from.size(), to.size(), weights.size()));
  }
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (!from[i].allFinite() || !to[i].allFinite()) {
      Fail(fmt::format("point {} is not finite; leave it out", i));
    }
    if (!weights.empty() && !(std::isfinite(weights[i]) && weights[i] > 0)) {
      Fail(fmt::format("weight {} of point {} is not a positive number", weights[i], i));
    }
  }
  if (!(std::isfinite(options.stiffness_mm) && options.stiffness_mm >= 0)) {
    Fail(fmt::format("stiffness_mm is {}; it must be 0 or more", options.stiffness_mm));
  }
}

// Moves the points' mean to the origin and their mean spread to 1, which keeps the equations well
// conditioned.
struct Centred {
  Vec3 middle = Vec3::Zero();
  double spread_mm = 1;

  explicit Centred(std::span<const Vec3> points) {
    for (const Vec3& p : points) {
      middle += p / static_cast<double>(points.size());
    }
    double squares = 0;
    for (const Vec3& p : points) {
      squares += (p - middle).squaredNorm() / static_cast<double>(points.size());
    }
    spread_mm = squares > 0 ? std::sqrt(squares) : 1;
  }
  Vec3 operator()(const Vec3& p) const { return (p - middle) / spread_mm; }
};

Rows3 AsRows(std::span<const Vec3> points) {
  Rows3 rows(points.size(), 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    rows.row(static_cast<Eigen::Index>(i)) = points[i];
  }
  return rows;
}

// The matrix -|x_i - x_j|, plus the misfit terms on the diagonal.
MatrixXd Kernel(const Rows3& x, const Eigen::VectorXd& diagonal) {
  MatrixXd kernel(x.rows(), x.rows());
  for (Eigen::Index j = 0; j < x.rows(); ++j) {
    kernel.col(j) = -(x.rowwise() - x.row(j)).rowwise().norm();
  }
  kernel.diagonal() += diagonal;
  return kernel;
}

// The solution of kernel * c + affine_columns * a = y with c orthogonal to the affine columns.
struct Coefficients {
  Rows3 c;
  Eigen::Matrix<double, 4, 3> a;
};

// Solves on the space orthogonal to all affine functions, where the kernel is positive definite.
Coefficients Solve(const MatrixXd& kernel, const MatrixXd& affine_columns, const Rows3& y) {
  const Eigen::HouseholderQR<MatrixXd> qr(affine_columns);
  const MatrixXd q = qr.householderQ();
  const auto across = q.rightCols(q.cols() - 4);
  Coefficients found{.c = Rows3::Zero(y.rows(), 3), .a = {}};
  if (across.cols() > 0) {
    const Eigen::LLT<MatrixXd> factor(across.transpose() * kernel * across);
    if (factor.info() != Eigen::Success || factor.rcond() < 1e-14) {
      Fail("two points coincide, or nearly do; leave one out, or give the plate some stiffness");
    }
    found.c = across * factor.solve(across.transpose() * y);
  }
  found.a = qr.matrixQR().topRows<4>().triangularView<Eigen::Upper>().solve(
      q.leftCols<4>().transpose() * (y - kernel * found.c));
  return found;
}

MatrixXd AffineColumns(const Rows3& x) {
  MatrixXd columns(x.rows(), 4);
  columns << x, Eigen::VectorXd::Ones(x.rows());
  Eigen::ColPivHouseholderQR<MatrixXd> qr(4, 4);
  qr.setThreshold(1e-6);
  if (x.rows() < 4 || qr.compute(columns).rank() < 4) {
    Fail("the points lie in a plane, or are fewer than four; add one beside it");
  }
  return columns;
}

}  // namespace

Vec3 ThinPlate::operator()(const Vec3& p) const {
  Vec3 sum = affine.leftCols<3>() * p + affine.col(3);
  for (std::size_t i = 0; i < centers.size(); ++i) {
    sum -= (p - centers[i]).norm() * weights[i];
  }
  return sum;
}

ThinPlate FitThinPlate(std::span<const Vec3> from, std::span<const Vec3> to,
                       std::span<const double> weights, const ThinPlateOptions& options) {
  CheckPoints(from, to, weights, options);
  const Centred centred(from);
  std::vector<Vec3> unit(from.size());
  std::transform(from.begin(), from.end(), unit.begin(), centred);
  const Rows3 x = AsRows(unit);
  Eigen::VectorXd misfit = Eigen::VectorXd::Ones(x.rows());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    misfit[static_cast<Eigen::Index>(i)] = 1 / weights[i];
  }
  misfit *= 8 * std::numbers::pi * options.stiffness_mm / centred.spread_mm;
  const Coefficients found = Solve(Kernel(x, misfit), AffineColumns(x), AsRows(to));
  ThinPlate plate{.centers = {from.begin(), from.end()}, .weights = {}, .affine = {}};
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    plate.weights.push_back(found.c.row(i) / centred.spread_mm);
  }
  plate.affine.leftCols<3>() = found.a.topRows<3>().transpose() / centred.spread_mm;
  plate.affine.col(3) = found.a.row(3).transpose() - plate.affine.leftCols<3>() * centred.middle;
  return plate;
}

}  // namespace semblance::surfaces
