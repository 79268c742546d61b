// SPDX-License-Identifier: GPL-3.0-or-later
// Compares sigma with dense algebra and with the truth.
#include "fitting/solve/surface_sigma.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "fitting/least_squares/patch_energy.h"
#include "fitting/nested/nested_fit.h"
#include "fitting/problem/start_surface.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/scattered_data.h"

namespace semblance::fitting {
namespace {

using testing::FrankePoint;

struct Points {
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;
  std::vector<double> weights;

  AttributeColumns Columns() const { return {.uv = uv, .weights = weights, .columns = {}}; }
};

Points PointsAt(int count, std::uint64_t seed) {
  Random random(seed);
  Points points;
  for (int k = 0; k < count; ++k) {
    points.uv.emplace_back(random.Uniform(), random.Uniform());
    points.positions.push_back(FrankePoint(points.uv.back()));
    points.weights.push_back(random.Uniform(0.5, 2));
  }
  return points;
}

// Two levels, and the B-spline of each unknown as a surface.
HSplineSurface Refined(Closure closure) {
  HSplineSurface surface =
      testing::PlainStart({.patches_u = 5, .patches_v = 3, .max_level = 1, .closure = closure});
  std::map<VertexId, std::optional<Vec3>> offsets;
  for (int j = 2; j < 6; ++j) {
    for (int i = 0; i < 4; ++i) {
      offsets[{1, i, j}] = Vec3(0.1, 0, 0.01 * i);
    }
  }
  surface.SetOffsets(offsets);
  return surface;
}

std::vector<HSplineSurface> Functions(const HSplineSurface& surface) {
  const HSplineSurface empty = EmptyLike(surface);
  std::vector<HSplineSurface> functions;
  for (std::size_t k = 0; k < empty.Net(0).vertices.size(); ++k) {
    ControlNet net = empty.Net(0);
    net.vertices[k].x() = 1;
    functions.push_back(empty);
    functions.back().SetNet(0, net);
  }
  for (const auto& [vertex, offset] : empty.Offsets()) {
    functions.push_back(empty);
    functions.back().SetOffsets({{vertex, Vec3::UnitX()}});
  }
  return functions;
}

TEST(SurfaceSigma, IsThatOfDenseLeastSquares) {
  for (const Closure closure : {Closure::kOpen, Closure::kPeriodicU}) {
    const HSplineSurface surface = Refined(closure);
    const std::vector<HSplineSurface> functions = Functions(surface);
    const Points points = PointsAt(600, 3);
    const auto row = [&](const Vec2& uv) {
      Eigen::VectorXd n(static_cast<Eigen::Index>(functions.size()));
      for (Eigen::Index k = 0; k < n.size(); ++k) {
        n[k] = functions[static_cast<std::size_t>(k)].Point(uv).x();
      }
      return n;
    };
    const std::vector<std::uint32_t> left_out = {0, 17, 599};
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(std::ssize(functions), std::ssize(functions));
    double weights = 0;
    for (std::uint32_t k = 0; k < 600; ++k) {
      if (k != 0 && k != 17 && k != 599) {
        const Eigen::VectorXd n = row(points.uv[k]);
        normal += points.weights[k] * n * n.transpose();
        weights += points.weights[k];
      }
    }
    constexpr double kNoise = 0.02;
    const SurfaceSigma sigma(surface, points.Columns(), left_out,
                             {.noise_mm = kNoise, .weight = 0, .lengths_mm = {1, 1}});
    // Some of the functions are sums of others.
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> dense(normal.rows(), normal.cols());
    dense.setThreshold(1e-11);
    dense.compute(normal);
    EXPECT_NEAR(sigma.degrees_of_freedom(), static_cast<double>(dense.rank()), 0.05);
    const Eigen::MatrixXd inverse = dense.pseudoInverse();
    const std::vector<Vec2> at = PointsAt(50, 8).uv;
    const auto expect = [&](const SurfaceSigma& of, const Eigen::MatrixXd& covariance) {
      const std::vector<double> found = of.At(at);
      for (std::size_t k = 0; k < at.size(); ++k) {
        const Eigen::VectorXd n = row(at[k]);
        const double expected = kNoise * std::sqrt(weights / 597 * n.dot(covariance * n));
        EXPECT_NEAR(found[k], expected, 1e-3 * expected);
      }
    };
    expect(sigma, inverse);
    // The surface is held at five places, one of them twice.
    std::vector<Vec2> met = PointsAt(5, 11).uv;
    met.push_back(met[0]);
    const SurfaceSigma held(surface, points.Columns(), left_out,
                            {.noise_mm = kNoise, .weight = 0, .lengths_mm = {1, 1}, .met = met});
    Eigen::MatrixXd equations(5, normal.cols());
    for (Eigen::Index k = 0; k < 5; ++k) {
      equations.row(k) = row(met[static_cast<std::size_t>(k)]).transpose();
    }
    const Eigen::MatrixXd ways = inverse * equations.transpose();
    const Eigen::MatrixXd taken = ways * (equations * ways).inverse() * ways.transpose();
    expect(held, inverse - taken);
    EXPECT_NEAR(held.degrees_of_freedom(), static_cast<double>(dense.rank()) - 5, 0.05);
    for (const double at_held : held.At(met)) {
      EXPECT_LT(at_held, 1e-3 * sigma.At(at)[0]);
    }
  }
}

// The nested fit estimates the number of parameters with one random probe, whose standard deviation
// is at most sqrt(2 n) for n parameters.
TEST(SurfaceSigma, CountsTheParametersOfTheFitAndHoldsTheTruth) {
  constexpr int kCount = 20000;
  constexpr double kNoise = 1e-3;
  Points points = PointsAt(kCount, 5);
  points.weights.clear();
  Random random(6);
  for (Vec3& position : points.positions) {
    position.z() += kNoise * random.Normal();
  }
  const HSplineSurface start =
      StartSurface({.patches_u = 8, .patches_v = 8, .max_level = 0}, points.positions, points.uv);
  const NestedFitResult fit = FitNested(start, {points.positions, points.uv}, {}, {});
  const SurfaceSigma sigma(fit.surface, points.Columns(), fit.report.outliers,
                           {.noise_mm = fit.report.noise_mm,
                            .weight = fit.report.weight,
                            .lengths_mm = MeanLengths(start)});
  const double freedom =
      fit.report.rounds[static_cast<std::size_t>(fit.report.chosen_round)].degrees_of_freedom;
  EXPECT_NEAR(sigma.degrees_of_freedom(), freedom, 4 * std::sqrt(2 * freedom) + 0.2 * freedom);
  const std::vector<Vec2> at = PointsAt(4000, 9).uv;
  const std::vector<double> sd = sigma.At(at);
  int within = 0;
  for (std::size_t k = 0; k < at.size(); ++k) {
    const double off = fit.surface.Point(at[k]).z() - FrankePoint(at[k]).z();
    within += std::abs(off) < 1.6449 * sd[k] ? 1 : 0;
  }
  EXPECT_NEAR(within / 4000.0, 0.90, 0.06);
}

// With a stretch along the crests, waves along one direction leave fewer parameters.
TEST(SurfaceSigma, UsesTheStretchOfTheFit) {
  Points points = PointsAt(2000, 5);
  points.weights.clear();
  Random random(6);
  for (std::size_t k = 0; k < points.uv.size(); ++k) {
    const Vec2& q = points.uv[k];
    const double wave = std::sin(25 * (0.8 * q.x() + 0.6 * q.y()));
    points.positions[k] = Vec3(q.x(), q.y(), 0.06 * wave + 5e-3 * random.Normal());
  }
  const HSplineSurface start =
      StartSurface({.patches_u = 8, .patches_v = 8, .max_level = 0}, points.positions, points.uv);
  const NestedFitResult fit = FitNested(start, {points.positions, points.uv}, {}, {});
  const AutoReport& report = fit.report;
  ASSERT_GT(report.stretch, 2);
  SigmaOptions options{.noise_mm = report.noise_mm,
                       .weight = report.weight,
                       .stretch = report.stretch,
                       .direction_deg = report.direction_deg,
                       .lengths_mm = MeanLengths(start)};
  const auto counted = [&] {
    return SurfaceSigma(fit.surface, points.Columns(), report.outliers, options)
        .degrees_of_freedom();
  };
  const double freedom =
      report.rounds[static_cast<std::size_t>(report.chosen_round)].degrees_of_freedom;
  const double stretched = counted();
  EXPECT_NEAR(stretched, freedom, 4 * std::sqrt(2 * freedom) + 0.2 * freedom);
  options.stretch = 1;
  EXPECT_GT(std::abs(counted() - stretched), 0.2 * stretched);
}

// With as many parameters as half of the points, the choice of smoothness makes sigma a factor of
// sqrt(2) too small.
TEST(SurfaceSigma, AllowsForTheChoiceOfSmoothness) {
  const HSplineSurface surface = Refined(Closure::kOpen);
  const std::vector<Vec2> at = PointsAt(20, 3).uv;
  for (const int count : {100, 5000}) {
    const SurfaceSigma sigma(surface, PointsAt(count, 1).Columns(), {},
                             {.noise_mm = 1, .weight = 1e-6, .lengths_mm = {1, 1}});
    const double factor = 1 / std::sqrt(1 - sigma.degrees_of_freedom() / count);
    ASSERT_LT(factor, 7);
    ASSERT_GT(factor, count == 100 ? 1.1 : 1);
    for (std::size_t k = 0; k < at.size(); ++k) {
      EXPECT_DOUBLE_EQ(sigma.OfChosen(at)[k], factor * sigma.At(at)[k]);
    }
  }
}

TEST(SurfaceSigma, IsLargeWhereNothingIsDetermined) {
  const HSplineSurface surface = Refined(Closure::kOpen);
  const SigmaOptions options{.noise_mm = 1, .weight = 0, .lengths_mm = {1, 1}};
  const std::vector<Vec2> middle = {{0.5, 0.5}};
  const SurfaceSigma few(surface, PointsAt(10, 1).Columns(), {}, options),
      many(surface, PointsAt(600, 1).Columns(), {}, options);
  EXPECT_GT(few.At(middle)[0], 100 * many.At(middle)[0]);
  const Points one = PointsAt(1, 1);
  const std::vector<std::uint32_t> all = {0};
  EXPECT_THROW(SurfaceSigma(surface, one.Columns(), all, options), InputError);
  EXPECT_THROW(SurfaceSigma(surface, PointsAt(600, 1).Columns(), {}, {}), InputError);
}

}  // namespace
}  // namespace semblance::fitting
