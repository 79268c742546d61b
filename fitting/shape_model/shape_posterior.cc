// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/shape_model/shape_posterior.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "surfaces/base/parallel.h"

namespace semblance {

Eigen::VectorXd ShapePrior::Deviations(Eigen::Index parameters) const {
  Eigen::VectorXd deviations = Eigen::VectorXd::Ones(parameters);
  deviations[0] = scale_sd;
  deviations.segment<3>(1).setConstant(rotation_sd);
  deviations.segment<3>(4).setConstant(translation_sd);
  return deviations;
}

Eigen::MatrixXd InformationOf(const ShapeFrame& frame, const ShapeParameters& parameters,
                              std::span<const ShapeObservation> seen, const ShapePrior& prior) {
  Eigen::Index count = 0, row = 0;
  for (const ShapeObservation& one : seen) {
    count += one.whitening.rows();
  }
  Eigen::MatrixXd jacobian(count, parameters.size());
  for (const ShapeObservation& one : seen) {
    ShapeDerivatives derivatives;
    const Vec3 placed = PlacedPoint(frame, one.row, parameters, &derivatives);
    const double root = std::sqrt(one.weight * LossWeight(one, placed));
    for (Eigen::Index r = 0; r < one.whitening.rows(); ++r) {
      jacobian.row(row++) =
          root * DerivativeAlong(one.whitening.row(r).transpose(), one.row, derivatives);
    }
  }
  Eigen::MatrixXd information = jacobian.transpose() * jacobian;
  information.diagonal() += prior.Deviations(parameters.size()).array().inverse().square().matrix();
  return information;
}

std::vector<double> DeviationsAlong(const ShapeFrame& frame, const ShapeParameters& parameters,
                                    const Eigen::MatrixXd& information,
                                    std::span<const ShapeRow> rows,
                                    std::span<const Vec3> directions, int threads) {
  constexpr std::size_t kBlock = 128;  // columns that are solved for at once
  const Eigen::LLT<Eigen::MatrixXd> factor(information);
  std::vector<double> deviations(rows.size(), kNaN);
  ParallelFor((rows.size() + kBlock - 1) / kBlock, threads, 1, [&](std::size_t block) {
    const std::size_t begin = block * kBlock, end = std::min(begin + kBlock, rows.size());
    Eigen::MatrixXd along(parameters.size(), static_cast<Eigen::Index>(end - begin));
    for (std::size_t k = begin; k < end; ++k) {
      ShapeDerivatives derivatives;
      PlacedPoint(frame, rows[k], parameters, &derivatives);
      along.col(k - begin) = DerivativeAlong(directions[k], rows[k], derivatives).transpose();
    }
    factor.matrixL().solveInPlace(along);
    for (std::size_t k = begin; k < end; ++k) {
      deviations[k] = along.col(k - begin).norm();
    }
  });
  return deviations;
}

}  // namespace semblance
