// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/shape_model/shape_posterior.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "surfaces/base/parallel.h"

namespace semblance {

Eigen::VectorXd ShapePrior::Deviations(const ShapeParameters& parameters) const {
  Eigen::VectorXd deviations = Eigen::VectorXd::Ones(parameters.size());
  deviations[0] = scale_sd;
  deviations.segment<3>(1).setConstant(rotation_sd);
  deviations.segment<3>(4).setConstant(translation_sd);
  deviations.segment(7, parameters.coefficients.size()).setConstant(mode_sd);
  return deviations;
}

ShapePosterior PosteriorOf(const ShapeFrame& frame, const ShapeParameters& parameters,
                           std::span<const ShapeObservation> seen, const ShapePrior& prior) {
  Eigen::Index count = 0, row = 0;
  for (const ShapeObservation& one : seen) {
    count += one.whitening.rows();
  }
  Eigen::MatrixXd jacobian(count, parameters.size());
  Eigen::VectorXd shared(count);
  for (const ShapeObservation& one : seen) {
    ShapeDerivatives derivatives;
    const Vec3 placed = PlacedPoint(frame, one.row, parameters, &derivatives);
    const double root = std::sqrt(one.weight * LossWeight(one, placed));
    for (Eigen::Index r = 0; r < one.whitening.rows(); ++r) {
      const Vec3 direction = root * one.whitening.row(r).transpose();
      jacobian.row(row) = DerivativeAlong(direction, one.row, derivatives);
      shared[row++] = direction.dot(one.shared_mm);
    }
  }
  ShapePosterior posterior{jacobian.transpose() * jacobian, jacobian.transpose() * shared};
  posterior.information.diagonal() +=
      prior.Deviations(parameters).array().inverse().square().matrix();
  return posterior;
}

std::vector<double> DeviationsAlong(const ShapeFrame& frame, const ShapeParameters& parameters,
                                    const ShapePosterior& posterior, const Population& population,
                                    std::span<const ShapeRow> rows,
                                    std::span<const Vec3> directions, int threads) {
  constexpr std::size_t kBlock = 128;  // columns that are solved for at once
  const Eigen::LLT<Eigen::MatrixXd> factor(posterior.information);
  const double taken = 1 / (population.mode_sd * population.mode_sd),
               wider = std::pow(population.population_sd * taken, 2) - taken;
  const Eigen::Index modes = parameters.coefficients.size();
  std::vector<double> deviations(rows.size(), kNaN);
  ParallelFor((rows.size() + kBlock - 1) / kBlock, threads, 1, [&](std::size_t block) {
    const std::size_t begin = block * kBlock, end = std::min(begin + kBlock, rows.size());
    Eigen::MatrixXd along(parameters.size(), static_cast<Eigen::Index>(end - begin));
    for (std::size_t k = begin; k < end; ++k) {
      ShapeDerivatives derivatives;
      PlacedPoint(frame, rows[k], parameters, &derivatives);
      along.col(k - begin) = DerivativeAlong(directions[k], rows[k], derivatives).transpose();
    }
    const Eigen::MatrixXd answer = factor.solve(along);
    for (std::size_t k = begin; k < end; ++k) {
      const auto a = along.col(k - begin);
      const auto x = answer.col(k - begin);
      const double moved = posterior.shared.dot(x);
      const double variance = a.dot(x) + wider * x.segment(7, modes).squaredNorm() + moved * moved;
      deviations[k] = std::sqrt(std::max(variance, 0.0));
    }
  });
  return deviations;
}

}  // namespace semblance
