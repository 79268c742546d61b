// SPDX-License-Identifier: GPL-3.0-or-later
// Laws that every term obeys; a new entry of the variant is tested without being named here.
#include "fitting/term.h"

#include <ceres/crs_matrix.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "fitting/term_cost.h"
#include "tests/testing/level_views.h"

namespace semblance {
namespace {

using testing::AllTerms;
using testing::NoisyView;
using testing::Sheet;

// Half the cost, and the Jacobian, as Ceres sees them.
struct Evaluated {
  double cost = kNaN;
  Eigen::MatrixXd jacobian;
};

std::vector<double> Residuals(const Term& term, const LevelView& view, ControlNet net) {
  ceres::Problem problem;
  std::visit([&](const auto& t) { AddResiduals(t, view, net, problem); }, term);
  ceres::Problem::EvaluateOptions options;
  options.apply_loss_function = false;
  std::vector<double> residuals;
  problem.Evaluate(options, nullptr, &residuals, nullptr, nullptr);
  return residuals;
}

Evaluated Evaluate(const Term& term, const LevelView& view, const ControlNet& at) {
  ControlNet net = at;
  ceres::Problem problem;
  std::visit([&](const auto& t) { AddResiduals(t, view, net, problem); }, term);
  ceres::Problem::EvaluateOptions options;
  options.apply_loss_function = false;
  for (Vec3& v : net.vertices) {
    if (problem.HasParameterBlock(v.data())) {
      options.parameter_blocks.push_back(v.data());
    }
  }
  Evaluated result;
  ceres::CRSMatrix crs;
  problem.Evaluate(options, nullptr, nullptr, nullptr, &crs);
  result.jacobian = Eigen::MatrixXd::Zero(crs.num_rows, crs.num_cols);
  for (int row = 0; row < crs.num_rows; ++row) {
    for (int k = crs.rows[row]; k < crs.rows[row + 1]; ++k) {
      result.jacobian(row, crs.cols[k]) = crs.values[k];
    }
  }
  options.apply_loss_function = true;
  problem.Evaluate(options, &result.cost, nullptr, nullptr, nullptr);
  return result;
}

TEST(Terms, JacobianEqualsItsNumericTwin) {
  const LevelView view = NoisyView();
  for (const Term& term : AllTerms()) {
    SCOPED_TRACE(TermName(term));
    const Evaluated here = Evaluate(term, view, view.start);
    ASSERT_EQ(here.jacobian.cols(), 3 * static_cast<int>(view.start.vertices.size()));
    for (int c = 0; c < here.jacobian.cols(); ++c) {
      ControlNet plus = view.start, minus = view.start;
      plus.vertices[c / 3][c % 3] += 0.5;  // exact: the residuals are linear
      minus.vertices[c / 3][c % 3] -= 0.5;
      const std::vector<double> a = Residuals(term, view, plus), b = Residuals(term, view, minus);
      for (int r = 0; r < here.jacobian.rows(); ++r) {
        ASSERT_NEAR(here.jacobian(r, c), a[r] - b[r], 1e-9);
      }
    }
  }
}

TEST(Terms, ResidualsAddUpToTheDocumentedCost) {
  const LevelView view = NoisyView();
  for (const Term& term : AllTerms()) {
    SCOPED_TRACE(TermName(term));
    const ControlNet net = Sheet(4, 3, 7, 9), other = Sheet(4, 3, 6, 10);
    const auto cost = [&](const ControlNet& at) {
      return std::visit([&](const auto& t) { return TermCost(t, view, at); }, term);
    };
    EXPECT_GT(cost(net), 0);
    EXPECT_NEAR(2 * (Evaluate(term, view, net).cost - Evaluate(term, view, other).cost),
                cost(net) - cost(other), 1e-11 * cost(net));
  }
}

TEST(Terms, AreMeansThatDoNotGrowWithTheData) {
  const LevelView view = NoisyView();
  LevelView twice = view;
  twice.observations.insert(twice.observations.end(), view.observations.begin(),
                            view.observations.end());
  const double once = TermCost(PointTerm{}, view, view.start);
  EXPECT_NEAR(TermCost(PointTerm{}, twice, view.start), once, 1e-12 * once);
  EXPECT_NEAR(TermCost(PointTerm{}, view, view.start),
              std::pow(ObservationRms(view, view.start), 2), 1e-12 * once);
}

TEST(Terms, AffineMapsOfTheTemplateDoNotBend) {
  LevelView view = NoisyView();
  Mat3 map;
  map << 1.1, 0.2, 0.3, -0.4, 0.9, 0, 0.1, 0.5, 1;
  for (std::size_t k = 0; k < view.rest.vertices.size(); ++k) {
    const int i = static_cast<int>(k) % view.rest.columns,
              j = static_cast<int>(k) / view.rest.columns;
    view.start.vertices[k] = view.rest.vertices[k] + map * Vec3(i, j, 40);
  }
  EXPECT_NEAR(TermCost(SmoothnessTerm{}, view, view.start), 0, 1e-12);
  EXPECT_GT(TermCost(MembraneTerm{}, view, view.start), 1e-3);
}

TEST(Terms, TangentPointsWithoutSlidingArePoints) {
  const LevelView view = NoisyView();
  const double points = TermCost(PointTerm{}, view, view.start);
  EXPECT_NEAR(TermCost(TangentPointTerm{.tangential = 1}, view, view.start), points,
              1e-12 * points);
  // A flat sheet that slides within itself costs only what sliding is said to.
  LevelView flat = view;
  for (ControlNet* const net : {&flat.start, &flat.rest}) {
    *net = Sheet(4, 3, 0, 0);
    for (Vec3& v : net->vertices) {
      v.z() = 0;
    }
  }
  for (Observation& o : flat.observations) {
    o.position = flat.grid.StencilAt(o.uv).Apply(flat.start) + Vec3(3, 4, 0);
  }
  EXPECT_NEAR(TermCost(TangentPointTerm{.tangential = 0}, flat, flat.start), 0, 1e-12);
  EXPECT_NEAR(TermCost(TangentPointTerm{.tangential = 0.1}, flat, flat.start), 2.5, 1e-12);
}

// Mirrored at the sheet's plane x = 40, wherever the whole is turned to.
TEST(Terms, MirroredDisplacementsAreSymmetric) {
  LevelView view = NoisyView();
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).matrix();
  for (int j = 0; j < view.rest.rows; ++j) {
    for (int i = 0; i < view.rest.columns; ++i) {
      const int twin = view.rest.columns - 1 - i;
      view.rest.At(i, j).z() = 5 * std::cos(i - 3);
      view.start.At(i, j) = view.rest.At(i, j) + Vec3(i - twin, 2 + j, std::cos(i - 3));
    }
  }
  for (std::size_t k = 0; k < view.rest.vertices.size(); ++k) {
    view.rest.vertices[k] = turn * view.rest.vertices[k];
    view.start.vertices[k] = turn * view.start.vertices[k];
  }
  const SymmetryTerm surface{.of = SmoothnessOf::kSurface};
  EXPECT_NEAR(TermCost(SymmetryTerm{}, view, view.start), 0, 1e-12);
  EXPECT_NEAR(TermCost(surface, view, view.start), 0, 1e-12);
  view.start.At(1, 1) += turn * Vec3(1, 0, 0);
  EXPECT_NEAR(TermCost(SymmetryTerm{.weight = 1}, view, view.start), 2.0 / 42, 1e-12);
}

}  // namespace
}  // namespace semblance
