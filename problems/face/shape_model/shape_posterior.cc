// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/shape_model/shape_posterior.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "surfaces/base/parallel.h"
#include "surfaces/base/random.h"

namespace semblance::problems {

Eigen::Matrix3d MakeWhitening(const PointSpread& s) {
  const auto square = [](double x) { return x * x; };
  const Mat3 along_normal = s.normal * s.normal.transpose();
  const Mat3 covariance = square(s.normal_sd_mm) * along_normal +
                          square(s.tangent_sd_mm) * (Mat3::Identity() - along_normal) +
                          square(s.along_sd_mm) * s.direction * s.direction.transpose();
  return covariance.llt().matrixL().solve(Mat3::Identity());
}

double LossWeight(const ShapeObservation& seen, const Vec3& placed) {
  const double residual = (seen.whitening * (placed - seen.position)).norm();
  return residual <= seen.loss_width ? 1 : seen.loss_width / residual;
}
namespace {

// The observations' rows, each times the root of its weight.
struct SeenRows {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd shared;            // one standard deviation of the shared error
  std::vector<Eigen::Index> smooth;  // rows with a smooth error
  std::vector<Vec3> smooth_at;       // their positions, mm
  std::vector<double> smooth_sd;     // their deviations, in the units of the rows
};

SeenRows MakeRows(const ShapeFrame& frame, const ShapeParameters& parameters,
                  std::span<const ShapeObservation> seen) {
  Eigen::Index count = 0, row = 0;
  for (const ShapeObservation& one : seen) {
    count += one.whitening.rows();
  }
  SeenRows rows{Eigen::MatrixXd(count, parameters.size()), Eigen::VectorXd(count), {}, {}, {}};
  for (const ShapeObservation& one : seen) {
    ShapeDerivatives derivatives;
    const Vec3 placed = PlacedPoint(frame, one.row, parameters, &derivatives);
    const double root = std::sqrt(one.weight * LossWeight(one, placed));
    if (one.smooth_sd_mm > 0) {
      rows.smooth.push_back(row);
      rows.smooth_at.push_back(one.position);
      rows.smooth_sd.push_back(root * one.smooth_sd_mm * one.whitening.row(0).norm());
    }
    for (Eigen::Index r = 0; r < one.whitening.rows(); ++r) {
      const Vec3 direction = root * one.whitening.row(r).transpose();
      rows.jacobian.row(row) = DerivativeAlong(direction, one.row, derivatives);
      rows.shared[row++] = direction.dot(one.shared_mm);
    }
  }
  return rows;
}

// J' E J, where E is the covariance of the rows' errors without the shared part.
Eigen::MatrixXd GradientSpread(const SeenRows& rows, double length_mm) {
  const Eigen::Index count = std::ssize(rows.smooth);
  Eigen::MatrixXd alone = rows.jacobian, smooth(count, rows.jacobian.cols()), errors(count, count);
  for (Eigen::Index j = 0; j < count; ++j) {
    smooth.row(j) = rows.jacobian.row(rows.smooth[j]);
    alone.row(rows.smooth[j]).setZero();
    for (Eigen::Index k = 0; k < count; ++k) {
      const double squared = (rows.smooth_at[j] - rows.smooth_at[k]).squaredNorm();
      errors(j, k) =
          rows.smooth_sd[j] * rows.smooth_sd[k] * std::exp(-squared / (2 * length_mm * length_mm));
    }
  }
  return alone.transpose() * alone + smooth.transpose() * errors * smooth;
}

}  // namespace

Eigen::VectorXd ShapePrior::Deviations(const ShapeParameters& parameters) const {
  Eigen::VectorXd deviations = Eigen::VectorXd::Ones(parameters.size());
  deviations[0] = scale_sd;
  deviations.segment<3>(1).setConstant(rotation_sd);
  deviations.segment<3>(4).setConstant(translation_sd);
  deviations.segment(7, parameters.coefficients.size()).setConstant(mode_sd);
  return deviations;
}

ShapePosterior MakePosterior(const ShapeFrame& frame, const ShapeParameters& parameters,
                             std::span<const ShapeObservation> seen, const ShapePrior& prior,
                             double smooth_length_mm) {
  const SeenRows rows = MakeRows(frame, parameters, seen);
  ShapePosterior posterior{rows.jacobian.transpose() * rows.jacobian,
                           GradientSpread(rows, smooth_length_mm)};
  const Eigen::VectorXd shared = rows.jacobian.transpose() * rows.shared;
  posterior.spread += shared * shared.transpose();
  Eigen::VectorXd pull = prior.Deviations(parameters).array().inverse().square();
  posterior.information.diagonal() += pull;
  pull.segment(7, parameters.coefficients.size()) *=
      std::pow(prior.population_sd / prior.mode_sd, 2);
  posterior.spread.diagonal() += pull;
  return posterior;
}

std::vector<double> DeviationsAlong(const ShapeFrame& frame, const ShapeParameters& parameters,
                                    const ShapePosterior& posterior, std::span<const ShapeRow> rows,
                                    std::span<const Vec3> directions, int threads) {
  constexpr std::size_t kBlock = 128;  // right-hand sides per solve; bounds the memory
  const Eigen::LLT<Eigen::MatrixXd> factor(posterior.information);
  std::vector<double> deviations(rows.size(), kNaN);
  ParallelFor((rows.size() + kBlock - 1) / kBlock, threads, 1, [&](std::size_t block) {
    const std::size_t begin = block * kBlock, end = std::min(begin + kBlock, rows.size());
    Eigen::MatrixXd along(parameters.size(), static_cast<Eigen::Index>(end - begin));
    for (std::size_t k = begin; k < end; ++k) {
      ShapeDerivatives derivatives;
      PlacedPoint(frame, rows[k], parameters, &derivatives);
      along.col(k - begin) = DerivativeAlong(directions[k], rows[k], derivatives).transpose();
    }
    const Eigen::MatrixXd answer = factor.solve(along), pulled = posterior.spread * answer;
    for (std::size_t k = begin; k < end; ++k) {
      const double variance = answer.col(k - begin).dot(pulled.col(k - begin));
      deviations[k] = std::sqrt(std::max(variance, 0.0));
    }
  });
  return deviations;
}

ShapeParameters DrawParameters(const ShapeParameters& parameters, const ShapePosterior& posterior,
                               std::uint64_t random_seed) {
  Random random(random_seed);
  Eigen::VectorXd pull(parameters.size());
  for (double& value : pull) {
    value = random.Normal();
  }
  const Eigen::VectorXd spread = posterior.spread.llt().matrixL() * pull,
                        step = posterior.information.llt().solve(spread);
  return MoveParameters(parameters, step);
}

}  // namespace semblance::problems
