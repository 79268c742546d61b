// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/joint_posterior.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "surfaces/base/random.h"
#include "tests/testing/joint_case.h"

namespace semblance::problems {
namespace {

using testing::JointCase;

constexpr double kLength_mm = 12;  // of smooth errors

// A case that is nearly linear, because its pose hardly moves.
JointCase LinearCase(std::uint64_t random_seed) {
  JointCase c(random_seed);
  c.weights.prior.scale_sd = 1e-3;
  c.weights.prior.rotation_sd = 1e-3;
  c.weights.prior.translation_sd = 2;
  c.weights.residual.sd_mm = 3;
  return c;
}

struct Places {
  std::vector<Vec2> uv;
  std::vector<Vec3> directions;
};

Places SomePlaces() {
  Random random(5);
  Places places;
  for (int k = 0; k < 6; ++k) {
    places.uv.emplace_back(random.Uniform(0, 1), random.Uniform(0, 1));
    places.directions.push_back(random.InBox(-1, 1).normalized());
  }
  return places;
}

Eigen::Index UnknownCount(const JointState& state) {
  return state.parameters.size() + 3 * std::ssize(state.residual[0].vertices);
}

// The state after a step of all unknowns of level 0.
JointState MoveState(JointState state, const Eigen::VectorXd& step) {
  const Eigen::Index model = state.parameters.size();
  state.parameters = MoveParameters(state.parameters, step.head(model));
  Eigen::Map<Eigen::VectorXd>(state.residual[0].vertices[0].data(), step.size() - model) +=
      step.tail(step.size() - model);
  return state;
}

// The derivatives of S(u,v) by all unknowns, by central differences.
Eigen::MatrixXd PointJacobian(const JointCase& c, const Vec2& uv) {
  constexpr double kStep = 1e-5;
  Eigen::MatrixXd jacobian(3, UnknownCount(c.state));
  for (Eigen::Index k = 0; k < jacobian.cols(); ++k) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(jacobian.cols(), k);
    jacobian.col(k) = (MoveState(c.state, step).Point(c.model, uv) -
                       MoveState(c.state, -step).Point(c.model, uv)) /
                      (2 * kStep);
  }
  return jacobian;
}

// The covariance of the unknowns before any observation.
Eigen::MatrixXd PriorCovariance(const JointCase& c) {
  const Eigen::MatrixXd deviation = testing::DeviationCovariance(c);
  const Eigen::Index model = c.state.parameters.size(), vertices = deviation.rows();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(model + 3 * vertices, model + 3 * vertices);
  covariance.topLeftCorner(model, model) =
      c.weights.prior.Deviations(c.state.parameters).array().square().matrix().asDiagonal();
  for (Eigen::Index a = 0; a < vertices; ++a) {
    for (Eigen::Index b = 0; b < vertices; ++b) {
      covariance.block<3, 3>(model + 3 * a, model + 3 * b) = deviation(a, b) * Mat3::Identity();
    }
  }
  return covariance;
}

// The rows of the observations, by differences.
Eigen::MatrixXd ObservedRows(const JointCase& c) {
  Eigen::MatrixXd rows(3 * std::ssize(c.data.dowels), UnknownCount(c.state));
  for (Eigen::Index n = 0; n < std::ssize(c.data.dowels); ++n) {
    rows.middleRows<3>(3 * n) = c.data.dowels[n].whitening * PointJacobian(c, c.data.dowels[n].uv);
  }
  return rows;
}

// A case whose errors are shared, smooth and larger among people.
JointCase CorrelatedCase() {
  JointCase c = LinearCase(3);
  c.weights.prior.population_sd = 1.7;
  for (SurfaceObservation& dowel : c.data.dowels) {
    dowel.shared_mm = Vec3(0.3, -0.2, 0.5);
  }
  Random random(8);
  for (int k = 0; k < 5; ++k) {
    const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
    c.data.seeds.push_back({.uv = uv,
                            .position = c.Point(uv) + Vec3(0, 0, 0.1),
                            .whitening = Vec3(0, 0.3, 0.6).transpose(),
                            .loss_width = 1e9,
                            .weight = 0.25,
                            .smooth_sd_mm = 2});
  }
  return c;
}

JointPosterior MakeCasePosterior(const JointCase& c) {
  return JointPosterior(c.model, c.data, c.weights, kLength_mm, 0, c.state);
}

// Conditions the dense prior covariance on the observations (no matrix of ours is inverted).
TEST(JointPosterior, EqualsTheConditionedCovarianceOfDenseMatrices) {
  const JointCase c = LinearCase(11);
  const Places places = SomePlaces();
  const std::vector<double> sigma =
      MakeCasePosterior(c).DeviationsAlong(places.uv, places.directions);
  const Eigen::MatrixXd prior = PriorCovariance(c), seen = ObservedRows(c);
  Eigen::MatrixXd inner = seen * prior * seen.transpose();
  inner.diagonal().array() += 1;
  const Eigen::MatrixXd posterior =
      prior - prior * seen.transpose() * inner.ldlt().solve(seen * prior);
  for (std::size_t k = 0; k < sigma.size(); ++k) {
    const Eigen::RowVectorXd along =
        places.directions[k].transpose() * PointJacobian(c, places.uv[k]);
    const double expected = std::sqrt((along * posterior * along.transpose()).value());
    EXPECT_NEAR(sigma[k], expected, 1e-4 * expected);
    EXPECT_LT(expected, std::sqrt((along * prior * along.transpose()).value()));
  }
}

// H^-1 M H^-1 by dense matrices, with errors that are shared, smooth or larger among people.
TEST(JointPosterior, CountsSharedAndSmoothErrorsAsTheirCovarianceStates) {
  const JointCase c = CorrelatedCase();
  const Eigen::MatrixXd prior = PriorCovariance(c), dowels = ObservedRows(c);
  Eigen::MatrixXd seeds(5, dowels.cols()), smooth(5, 5);
  Eigen::VectorXd shift(dowels.rows());
  for (Eigen::Index j = 0; j < 5; ++j) {
    const SurfaceObservation& a = c.data.seeds[j];
    seeds.row(j) = 0.5 * a.whitening * PointJacobian(c, a.uv);
    for (Eigen::Index k = 0; k < 5; ++k) {
      const double apart_mm = (a.position - c.data.seeds[k].position).norm();
      smooth(j, k) = std::pow(0.5 * 2 * a.whitening.norm(), 2) *
                     std::exp(-apart_mm * apart_mm / (2 * kLength_mm * kLength_mm));
    }
  }
  for (Eigen::Index n = 0; n < std::ssize(c.data.dowels); ++n) {
    shift.segment<3>(3 * n) = c.data.dowels[n].whitening * c.data.dowels[n].shared_mm;
  }
  const Eigen::MatrixXd pull = prior.inverse();
  const Eigen::MatrixXd information =
      pull + dowels.transpose() * dowels + seeds.transpose() * seeds;
  Eigen::MatrixXd people = pull;
  people.diagonal().segment(7, testing::kModeCount) *= 1.7 * 1.7;
  const Eigen::VectorXd shared = dowels.transpose() * shift;
  const Eigen::MatrixXd spread = people + dowels.transpose() * dowels +
                                 seeds.transpose() * smooth * seeds + shared * shared.transpose();
  const Eigen::MatrixXd inverse = information.inverse(), covariance = inverse * spread * inverse;
  const Places places = SomePlaces();
  const std::vector<double> sigma =
      MakeCasePosterior(c).DeviationsAlong(places.uv, places.directions);
  for (std::size_t k = 0; k < sigma.size(); ++k) {
    const Eigen::RowVectorXd along =
        places.directions[k].transpose() * PointJacobian(c, places.uv[k]);
    const double expected = std::sqrt((along * covariance * along.transpose()).value());
    EXPECT_NEAR(sigma[k], expected, 1e-4 * expected);
  }
}

// Random faces spread as sigma states.
TEST(JointPosterior, DrawsFacesThatSpreadAsSigmaStates) {
  constexpr int kDraws = 3000;
  const JointCase c = CorrelatedCase();
  const Places places = SomePlaces();
  const JointPosterior posterior = MakeCasePosterior(c);
  const std::vector<double> sigma = posterior.DeviationsAlong(places.uv, places.directions);
  std::vector<double> sums(sigma.size()), squares(sigma.size());
  for (int draw = 0; draw < kDraws; ++draw) {
    const JointState drawn = posterior.Draw(draw);
    for (std::size_t k = 0; k < sigma.size(); ++k) {
      const Vec3 move = drawn.Point(c.model, places.uv[k]) - c.Point(places.uv[k]);
      sums[k] += move.dot(places.directions[k]) / sigma[k];
      squares[k] += std::pow(move.dot(places.directions[k]) / sigma[k], 2);
    }
  }
  for (std::size_t k = 0; k < sigma.size(); ++k) {
    EXPECT_NEAR(sums[k] / kDraws, 0, 4 / std::sqrt(kDraws));
    EXPECT_NEAR(squares[k] / kDraws, 1, 4 * std::sqrt(2.0 / kDraws));
  }
  EXPECT_EQ(posterior.Draw(7).residual[0].vertices, posterior.Draw(7).residual[0].vertices);
}

// Faces drawn from the prior, observed with noise and fitted again, lie as far from the fit as
// sigma states.
TEST(JointPosterior, StatesTheErrorsOfFitsToDrawnFaces) {
  constexpr int kDraws = 400;
  const JointCase c = LinearCase(2);
  const Places places = SomePlaces();
  const std::vector<double> sigma =
      MakeCasePosterior(c).DeviationsAlong(places.uv, places.directions);
  const Eigen::MatrixXd root = PriorCovariance(c).llt().matrixL();
  Random random(31);
  const auto normals = [&random](Eigen::Index count) -> Eigen::VectorXd {
    return Eigen::VectorXd::NullaryExpr(count, [&random] { return random.Normal(); });
  };
  double squares = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    JointCase drawn = c;
    const JointState truth = MoveState(c.state, root * normals(root.rows()));
    for (SurfaceObservation& dowel : drawn.data.dowels) {
      const Mat3 whitening = dowel.whitening;
      dowel.position = truth.Point(c.model, dowel.uv) + whitening.inverse() * normals(3);
    }
    ASSERT_TRUE(SolveJointStep(drawn.model, drawn.data, drawn.weights, {.level = 0, .fraction = 1},
                               drawn.state)
                    .usable);
    for (std::size_t k = 0; k < sigma.size(); ++k) {
      const Vec3 error =
          drawn.state.Point(c.model, places.uv[k]) - truth.Point(c.model, places.uv[k]);
      squares += std::pow(error.dot(places.directions[k]) / sigma[k], 2);
    }
  }
  EXPECT_NEAR(squares / (kDraws * std::ssize(sigma)), 1, 0.12);
}

}  // namespace
}  // namespace semblance::problems
