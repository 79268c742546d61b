// SPDX-License-Identifier: GPL-3.0-or-later
// Compares exact points, borders and normals with a dense system of equations.
#include "fitting/solve/exact_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "fitting/fit.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/scattered_data.h"
#include "tests/testing/scratch_file.h"

namespace semblance::fitting {
namespace {

using testing::FrankePoint;
using ::testing::HasSubstr;
using testing::Scattered;

const FitOptions kByTolerance = {.plan = AdaptivePlan{.tolerance_mm = 1e-3, .finest = 0},
                                 .terms = {PointTerm{}},
                                 .solver = Solver::kFastest};

// Exact points 0.05 away from the surface, one of them with a slanted normal.
std::vector<ExactPoint> SomePoints() {
  std::vector<ExactPoint> exact;
  Random random(11);
  for (int k = 0; k < 6; ++k) {
    const Vec2 uv(random.Uniform(), random.Uniform());
    exact.push_back({.uv = uv, .position = FrankePoint(uv) + Vec3(0.01, 0, 0.05)});
  }
  exact[2].normal = Vec3(0.3, -0.2, 1);
  return exact;
}

void ExpectMet(const HSplineSurface& surface, const std::vector<ExactPoint>& exact) {
  for (const ExactPoint& point : exact) {
    EXPECT_LT((surface.Point(point.uv) - point.position).norm(), 1e-9);
    const SurfaceFrame frame = surface.Frame(point.uv);
    EXPECT_LT(std::abs(frame.du.dot(point.normal)), 1e-9);
    EXPECT_LT(std::abs(frame.dv.dot(point.normal)), 1e-9);
  }
}

// The minimum of sum |e|^2 over the coordinates of all vertices, with Lagrange multipliers.
Eigen::VectorXd DenseOptimum(const HSplineShape& shape, const FitTarget& target) {
  const Eigen::Index vertices = shape.Columns(0) * shape.Rows(0), unknowns = 3 * vertices;
  const auto row = [&](const Vec2& uv, DerivativeOrder order, const Vec3& along) {
    Eigen::VectorXd r = Eigen::VectorXd::Zero(unknowns);
    const Stencil stencil = StencilAt(shape, 0, uv, order);
    for (int k = 0; k < 16; ++k) {
      r.segment<3>(3 * stencil.index[k]) += stencil.weight[k] * along;
    }
    return r;
  };
  std::vector<Eigen::VectorXd> rows;
  std::vector<double> values;
  for (const ExactPoint& point : target.exact) {
    for (int c = 0; c < 3; ++c) {
      rows.push_back(row(point.uv, {}, Vec3::Unit(c)));
      values.push_back(point.position[c]);
    }
    if (point.normal.squaredNorm() > 0) {
      rows.push_back(row(point.uv, {.u = 1}, point.normal));
      rows.push_back(row(point.uv, {.v = 1}, point.normal));
      values.insert(values.end(), {0, 0});
    }
  }
  const Eigen::Index size = unknowns + std::ssize(rows);
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
  for (const FitPoint& p : target.points) {
    for (int c = 0; c < 3; ++c) {
      const Eigen::VectorXd r = row(p.uv, {}, Vec3::Unit(c));
      system.topLeftCorner(unknowns, unknowns) += r * r.transpose();
      right.head(unknowns) += p.position[c] * r;
    }
  }
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto at = unknowns + static_cast<Eigen::Index>(k);
    system.block(0, at, unknowns, 1) = rows[k];
    system.block(at, 0, 1, unknowns) = rows[k].transpose();
    right[at] = values[k];
  }
  return system.fullPivLu().solve(right);
}

TEST(ExactPoints, AllOtherPointsAreFittedByLeastSquares) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 0};
  FitTarget target = Scattered(FrankePoint, 500, 1e-3, 2);
  target.exact = SomePoints();
  const FitResult fit = Fit(testing::PlainStart(shape), target, {}, kByTolerance, {});
  ExpectMet(fit.surface, target.exact);
  const Eigen::VectorXd expected = DenseOptimum(shape, target);
  const ControlNet net = fit.surface.Net(0);
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    EXPECT_LT((net.vertices[k] - expected.segment<3>(3 * static_cast<Eigen::Index>(k))).norm(),
              1e-6);
  }
}

// The points are closer together than the vertices, so finer vertices are added there and nowhere
// else.
TEST(ExactPoints, FinerVerticesAreAddedWhereNeeded) {
  FitTarget target = Scattered(FrankePoint, 3000, 1e-3, 2);
  for (int k = 0; k < 4; ++k) {
    const Vec2 uv(0.5 + 0.01 * k, 0.5);
    target.exact.push_back({.uv = uv, .position = FrankePoint(uv) + Vec3(0, 0, k % 2 * 0.01)});
  }
  FitOptions options = kByTolerance;
  options.plan = AdaptivePlan{.tolerance_mm = 0.1, .finest = 5};
  options.terms = {PointTerm{}, SmoothnessTerm{.weight = 1e-8, .length_mm = 1}};
  const HSplineShape shape{.patches_u = 2, .patches_v = 2, .max_level = 5};
  const FitResult fit = Fit(testing::PlainStart(shape), target, {}, options, {});
  ExpectMet(fit.surface, target.exact);
  options.plan = AdaptivePlan{.tolerance_mm = 0.1, .finest = 0};
  EXPECT_LT(fit.surface.Offsets().size(), 1500u);
}

// The auto plan with a whole border of exact points, and outliers elsewhere.
TEST(ExactPoints, TheAutoPlanMeetsThem) {
  for (const Closure closure : {Closure::kOpen, Closure::kPeriodicU}) {
    const auto truth = [&](const Vec2& uv) {
      return closure == Closure::kOpen ? FrankePoint(uv) : testing::HeadPoint(uv);
    };
    FitTarget target = Scattered(truth, 4000, 1e-3, 2);
    target.points[77].position.z() += 3;
    for (int k = 0; k < 9; ++k) {
      const Vec2 uv(k / 9.0, 0);
      target.exact.push_back({.uv = uv, .position = truth(uv) + Vec3(0, 0, 0.004)});
    }
    const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 0, .closure = closure};
    const FitResult fit =
        Fit(testing::PlainStart(shape), target, {},
            {.plan = AutoPlan{},
             .terms = {PointTerm{}, SmoothnessTerm{.weight = AutoOr<double>::Auto()}},
             .solver = Solver::kFastest},
            {});
    ExpectMet(fit.surface, target.exact);
    EXPECT_LT(testing::ErrorAgainst(truth, fit.surface, 50).rms, 2e-3);
    EXPECT_THAT(fit.automatic->outliers, ::testing::Contains(77u));
  }
}

// The reported noise is that of the surface that meets the point.
TEST(ExactPoints, AnExactPointIsNotAnOutlier) {
  FitTarget target = Scattered(FrankePoint, 4000, 1e-3, 2);
  target.points[77].position.z() += 3;
  FitPoint& lifted = target.points[98];
  lifted.position.z() += 0.3;
  const HSplineShape shape{.patches_u = 8, .patches_v = 8, .max_level = 0};
  const FitOptions options{.plan = AutoPlan{},
                           .terms = {PointTerm{}, SmoothnessTerm{.weight = AutoOr<double>::Auto()}},
                           .solver = Solver::kFastest};
  const FitResult free = Fit(testing::PlainStart(shape), target, {}, options, {});
  EXPECT_THAT(free.automatic->outliers, ::testing::Contains(98u));
  target.exact.push_back({.uv = lifted.uv, .position = lifted.position});
  const FitResult fit = Fit(testing::PlainStart(shape), target, {}, options, {});
  ExpectMet(fit.surface, target.exact);
  EXPECT_EQ(fit.automatic->outliers, std::vector<std::uint32_t>{77});
  const auto mean_square = [](const FitResult& of) {
    double sum = 0;
    for (std::size_t k = 0; k < of.residual_mm.size(); ++k) {
      sum += k == 77 || k == 98 ? 0 : of.residual_mm[k] * of.residual_mm[k];
    }
    return sum;
  };
  EXPECT_NEAR(fit.automatic->noise_mm / free.automatic->noise_mm,
              std::sqrt(mean_square(fit) / mean_square(free)), 1e-2);
}

TEST(ExactPoints, ContradictionsAreRefused) {
  FitTarget target = Scattered(FrankePoint, 500, 1e-3, 2);
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 2};
  const auto refusal = [&](const FitOptions& options) {
    return testing::WordsOf<InputError>(
        [&] { Fit(testing::PlainStart(shape), target, {}, options, {}); });
  };
  const Vec2 uv(0.5, 0.5);
  target.exact = {{.uv = uv, .position = FrankePoint(uv)},
                  {.uv = uv, .position = FrankePoint(uv) + Vec3(0, 0, 0.1)}};
  EXPECT_THAT(refusal(kByTolerance), HasSubstr("is missed by 0.05 mm"));
  target.exact.pop_back();
  FitOptions other = kByTolerance;
  other.solver = Solver::kCeres;
  EXPECT_THAT(refusal(other), HasSubstr("solver: fastest"));
  other = kByTolerance;
  other.plan = CoarseToFinePlan{.finest = 1};
  EXPECT_THAT(refusal(other), HasSubstr("plan: auto or adaptive"));
  target.exact[0].uv.x() = 2;
  EXPECT_THAT(refusal(kByTolerance), HasSubstr("outside the domain"));
}

}  // namespace
}  // namespace semblance::fitting
