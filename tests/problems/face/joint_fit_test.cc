// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/joint_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/hspline/bspline.h"
#include "tests/testing/joint_case.h"

namespace semblance::problems {
namespace {

using testing::AnyVector;
using testing::DeviationCovariance;
using testing::JointCase;
using testing::kCentreCount;
using testing::kModeCount;

// The estimate in closed form. Without the vertices, which are eliminated, an observation's error
// and the deviation of the surface from the model add: covariance C + B D B', with D that of the
// vertices about the model. The pose makes this nonlinear, so Gauss-Newton steps are taken with
// dense matrices. Then the vertices are the model's plus the conditional mean of their deviation.
struct ClosedForm {
  ShapeParameters parameters;
  std::vector<Vec3> deviations;  // of the vertices

  explicit ClosedForm(const JointCase& c) : parameters(c.state.parameters) {
    const std::vector<SurfaceObservation>& seen = c.data.dowels;
    const Eigen::Index count = 3 * std::ssize(seen), size = parameters.size();
    const Eigen::MatrixXd basis = c.Basis(), deviation = DeviationCovariance(c);
    const Eigen::MatrixXd shared = basis * deviation * basis.transpose();
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(count, count);
    for (Eigen::Index a = 0; a < std::ssize(seen); ++a) {
      for (Eigen::Index b = 0; b < std::ssize(seen); ++b) {
        covariance.block<3, 3>(3 * a, 3 * b) = shared(a, b) * Mat3::Identity();
      }
      const Mat3 w = seen[a].whitening;
      covariance.block<3, 3>(3 * a, 3 * a) += (w.transpose() * w).inverse();
    }
    const Eigen::LDLT<Eigen::MatrixXd> factor(covariance);
    const Eigen::VectorXd pull = c.weights.prior.Deviations(parameters).array().inverse().square();
    Eigen::VectorXd residual(count);
    for (int round = 0; round < 60; ++round) {
      Eigen::MatrixXd jacobian(count, size);
      for (Eigen::Index n = 0; n < std::ssize(seen); ++n) {
        ShapeDerivatives derivatives;
        const ShapeRow row = c.model.RowAt(seen[n].uv);
        residual.segment<3>(3 * n) =
            PlacedPoint(c.state.frame, row, parameters, &derivatives) - seen[n].position;
        for (int axis = 0; axis < 3; ++axis) {
          jacobian.row(3 * n + axis) = DerivativeAlong(Vec3::Unit(axis), row, derivatives);
        }
      }
      Eigen::VectorXd at(size);
      at << StepBetween(c.state.parameters.pose, parameters.pose), parameters.coefficients,
          parameters.field;
      Eigen::MatrixXd normal = jacobian.transpose() * factor.solve(jacobian);
      normal.diagonal() += pull;
      const Eigen::VectorXd step = normal.ldlt().solve(
          jacobian.transpose() * factor.solve(residual) + pull.cwiseProduct(at));
      parameters = MoveParameters(parameters, -step);
    }
    const Eigen::VectorXd pulled = factor.solve(residual);
    for (std::size_t i = 0; i < c.model.rows.size(); ++i) {
      Vec3 vertex = Vec3::Zero();
      const Eigen::VectorXd pull_of_vertex = basis * deviation.col(static_cast<Eigen::Index>(i));
      for (Eigen::Index n = 0; n < std::ssize(seen); ++n) {
        vertex -= pull_of_vertex[n] * pulled.segment<3>(3 * n);
      }
      deviations.push_back(vertex);
    }
  }
};

double LargestDifference(const ShapeParameters& a, const ShapeParameters& b) {
  return std::max({StepBetween(a.pose, b.pose).cwiseAbs().maxCoeff(),
                   (a.coefficients - b.coefficients).cwiseAbs().maxCoeff(),
                   (a.field - b.field).cwiseAbs().maxCoeff()});
}

double LargestDistance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    most = std::max(most, (a[k] - b[k]).norm());
  }
  return most;
}

double SumOfTerms(const std::vector<TermCosts>& terms, double TermCosts::*cost) {
  double sum = 0;
  for (const TermCosts& term : terms) {
    sum += term.*cost;
  }
  return sum;
}

constexpr double kTolerance = 1e-7;

LevelSummary SolveCase(double fraction, JointCase& c) {
  return SolveJointStep(c.model, c.data, c.weights, {.level = 0, .fraction = fraction}, c.state,
                        kTolerance);
}

TEST(JointFit, EqualsTheClosedFormInWhichTheVerticesAreEliminated) {
  for (const double sd_mm : {1e-2, 1.0, 10.0, 300.0}) {
    JointCase c(7);
    c.weights.residual.sd_mm = sd_mm;
    const ClosedForm expected(c);
    const LevelSummary summary = SolveCase(1, c);
    ASSERT_TRUE(summary.usable) << summary.termination;
    // The step ends when an iteration lowers the cost by less than 1e-7 of it.
    EXPECT_LT(LargestDifference(c.state.parameters, expected.parameters), 5e-3) << sd_mm;
    EXPECT_LT(LargestDistance(c.state.residual[0].vertices, expected.deviations), 1e-2) << sd_mm;
    EXPECT_LT(SumOfTerms(summary.terms, &TermCosts::after),
              SumOfTerms(summary.terms, &TermCosts::before));
  }
}

// With a model that is exactly right the surface is the model's: the estimate of the prior alone.
TEST(JointFit, AnExactModelLeavesTheSurfaceOnTheModel) {
  JointCase c(3);
  c.weights.residual.sd_mm = 1e-3;
  SolveCase(1, c);
  for (const Vec3& deviation : c.state.residual[0].vertices) {
    EXPECT_LT(deviation.norm(), 1e-3);
  }
}

TEST(JointFit, AFractionGoesThatPartOfTheWay) {
  JointCase whole(5), part(5);
  SolveCase(1, whole);
  SolveCase(0.35, part);
  const std::vector<Vec3>&all = whole.state.residual[0].vertices,
        &some = part.state.residual[0].vertices;
  for (std::size_t k = 0; k < all.size(); ++k) {
    EXPECT_LT((some[k] - 0.35 * all[k]).norm(), 1e-12);
  }
  EXPECT_LT(
      (part.state.parameters.coefficients - 0.35 * whole.state.parameters.coefficients).norm(),
      1e-12);
}

// Detail of a finer level stays, and the whole surface meets the points.
TEST(JointFit, FinerDetailIsTakenOffTheObservations) {
  JointCase c(9, /*max_level=*/1);
  std::vector<Vec3>& fine = c.state.residual[1].vertices;
  for (std::size_t k = 0; k < fine.size(); ++k) {
    fine[k].z() += std::sin(1.7 * static_cast<double>(k));
  }
  const std::vector<Vec3> before = fine;
  c.weights.residual.sd_mm = 100;  // nearly free vertices
  Random random(1);
  for (SurfaceObservation& one : c.data.dowels) {
    one.position = c.Point(one.uv) + AnyVector(random, 2);
  }
  SolveCase(1, c);
  for (const SurfaceObservation& one : c.data.dowels) {
    EXPECT_LT((c.Point(one.uv) - one.position).norm(), 0.05);
  }
  const ControlNet moved = Refine(c.model.shape, c.state.residual[0], 0);
  for (std::size_t k = 0; k < fine.size(); ++k) {
    EXPECT_LT((fine[k] - before[k] - moved.vertices[k]).norm(), 1e-12);
  }
}

// A coarse level cannot follow what a finer one can.
TEST(JointFit, AFinerLevelComesCloser) {
  JointCase coarse(12, /*max_level=*/2), fine(12, /*max_level=*/2);
  coarse.weights.residual.sd_mm = fine.weights.residual.sd_mm = 20;
  SolveJointStep(coarse.model, coarse.data, coarse.weights, {0, 1}, coarse.state);
  const LevelSummary closer =
      SolveJointStep(fine.model, fine.data, fine.weights, {2, 1}, fine.state);
  EXPECT_LT(closer.rms_after_mm, closer.rms_before_mm);
  EXPECT_EQ(closer.free_vertices, fine.model.shape.Columns(2) * fine.model.shape.Rows(2));
}

TEST(JointFit, ALossBoundsThePullOfAFarTip) {
  const auto pull = [](double far_mm, double width) {
    JointCase c(4);
    for (SurfaceObservation& one : c.data.dowels) {
      one.position = c.Point(one.uv);
      one.whitening = 3 * Mat3::Identity();
      one.loss_width = width;
    }
    c.data.dowels[0].position.z() += far_mm;
    const Vec3 target = c.data.dowels[0].position;
    const double before = c.Point(c.data.dowels[0].uv).z();
    SolveCase(1, c);
    EXPECT_GT(target.z(), before);
    return c.Point(c.data.dowels[0].uv).z() - before;
  };
  EXPECT_GT(pull(40, 1e9), 1.7 * pull(20, 1e9));
  EXPECT_LT(pull(40, 0.5), 1.2 * pull(20, 0.5));
}

// Each part of the data has its own line, and an empty part has none.
TEST(JointFit, TheSummaryNamesThePartsOfTheCost) {
  JointCase c(6);
  c.data.seeds.push_back(c.data.dowels.back());
  const LevelSummary summary = SolveCase(0.5, c);
  std::vector<std::string> names;
  for (const TermCosts& term : summary.terms) {
    names.push_back(term.term);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"dowels", "seeds", "residual_field", "face_model"}));
  EXPECT_GT(summary.moved_vertices, 0);
  EXPECT_LT(summary.rms_after_mm, summary.rms_before_mm);
}

TEST(JointFit, RefusesALevelThatTheFaceDoesNotHave) {
  JointCase c(2);
  EXPECT_THROW(SolveJointStep(c.model, c.data, c.weights, {1, 1}, c.state), InputError);
}

}  // namespace
}  // namespace semblance::problems
