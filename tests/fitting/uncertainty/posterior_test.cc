// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/uncertainty/posterior.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

#include "fitting/fit.h"
#include "fitting/least_squares/normal_equations.h"
#include "fitting/terms/term_cost.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/level_views.h"
#include "tests/testing/scattered_data.h"
#include "tests/testing/splines.h"

namespace semblance {
namespace {

using testing::Observe;
using testing::Sheet;
using testing::View;

// 25 points on the left half of the sheet, known to 0.5 to 2 mm and weighted accordingly.
struct Problem {
  LevelView view = View(Sheet(4, 3, 0, 0), Observe(Sheet(4, 3, 0, 0), 25, 3, 0, 0.5));
  std::vector<double> sd_mm;
  std::vector<Term> terms = {PointTerm{}, MembraneTerm{.weight = 0.05},
                             PriorTerm{.weight = 0.01, .towards = PriorTowards::kTemplate}};
  std::vector<Vec2> uv = {{0.1, 0.2}, {0.3, 0.5}, {0.5, 0.9}, {0.75, 0.4}, {0.98, 0.98}};

  Problem() {
    Random random(4);
    for (Observation& o : view.observations) {
      sd_mm.push_back(random.Uniform(0.5, 2));
      o.weight = 7 / (sd_mm.back() * sd_mm.back());
    }
  }
};

// Draws of the terms' prior around the template, in mm: the cost of a net is weight_sum times
// minus twice the logarithm of its density, weight_sum = sum of the points' 1 / sd^2.
ControlNet DrawTruth(const Problem& problem, Random& random) {
  NormalMatrix normal(problem.view.grid);
  for (const Term& term : problem.terms) {
    if (const auto* const membrane = std::get_if<MembraneTerm>(&term)) {
      AddRows(*membrane, problem.view, normal);
    } else if (const auto* const prior = std::get_if<PriorTerm>(&term)) {
      AddRows(*prior, problem.view, normal);
    }
  }
  double weight_sum = 0;
  for (const double sd : problem.sd_mm) {
    weight_sum += 1 / (sd * sd);
  }
  const Eigen::MatrixXd precision = weight_sum * Eigen::MatrixXd(normal.Lower());  // its lower half
  const Eigen::LLT<Eigen::MatrixXd> factor(precision);
  const Eigen::MatrixXd draw = factor.matrixU().solve(
      Eigen::MatrixXd::NullaryExpr(precision.rows(), 3, [&] { return random.Normal(); }));
  ControlNet net = problem.view.rest;
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    net.vertices[k] += draw.row(k).transpose();
  }
  return net;
}

// True faces drawn from the prior, dowels with their noise, FitLevel: its error is as large as
// sigma says, near the points and far from them.
TEST(Posterior, SigmaIsTheErrorOfTheFit) {
  const Problem problem;
  const std::vector<double> sigma =
      PosteriorSigma(problem.view, problem.sd_mm, problem.terms, problem.uv);
  Random random(9);
  constexpr int kDraws = 700;  // x 3 coordinates; the estimate's own deviation is 1.5 %
  std::vector<double> squares(problem.uv.size(), 0);
  for (int draw = 0; draw < kDraws; ++draw) {
    const ControlNet truth = DrawTruth(problem, random);
    LevelView view = problem.view;
    for (std::size_t k = 0; k < view.observations.size(); ++k) {
      Observation& o = view.observations[k];
      const Vec3 noise(random.Normal(), random.Normal(), random.Normal());
      o.position = view.grid.StencilAt(o.uv).Apply(truth) + problem.sd_mm[k] * noise;
    }
    const ControlNet fitted = FitLevel(view, problem.terms).net;
    for (std::size_t k = 0; k < problem.uv.size(); ++k) {
      const Stencil s = view.grid.StencilAt(problem.uv[k]);
      squares[k] += (s.Apply(fitted) - s.Apply(truth)).squaredNorm() / (3 * kDraws);
    }
  }
  for (std::size_t k = 0; k < problem.uv.size(); ++k) {
    EXPECT_NEAR(std::sqrt(squares[k]), sigma[k], 0.06 * sigma[k]) << k;
  }
  EXPECT_GT(sigma.back(), 2 * sigma.front());  // no point is near
}

TEST(Posterior, ScalesWithTheDeviationsAndNotWithTheWeights) {
  Problem problem;
  const std::vector<double> once =
      PosteriorSigma(problem.view, problem.sd_mm, problem.terms, problem.uv);
  for (std::size_t k = 0; k < problem.sd_mm.size(); ++k) {
    problem.sd_mm[k] *= 3;
    problem.view.observations[k].weight *= 5;
  }
  const std::vector<double> thrice =
      PosteriorSigma(problem.view, problem.sd_mm, problem.terms, problem.uv);
  for (std::size_t k = 0; k < once.size(); ++k) {
    EXPECT_NEAR(thrice[k], 3 * once[k], 1e-9 * once[k]);
  }
}

TEST(Posterior, OfASurfaceIsThatOfItsLevel) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 3, .max_level = 1};
  const HSplineSurface rest = testing::SmoothSurface(shape, 1);
  FitTarget target;
  for (int k = 0; k < 100; ++k) {
    const Vec2 uv((k % 10 + 0.5) / 10, (k / 10 + 0.5) / 10);
    target.points.push_back({.label = "a", .position = rest.Point(uv), .uv = uv});
  }
  const std::vector<double> sd_mm(100, 1.0);
  const std::vector<Vec2> uv = {{0.5, 0.5}, {0.2, 0.7}};
  const std::vector<Term> terms = {PointTerm{}, SmoothnessTerm{}};
  const auto coarse = PosteriorSigma(rest, rest, target, sd_mm, 0, terms, uv);
  const auto fine = PosteriorSigma(rest, rest, target, sd_mm, 1, terms, uv);
  for (std::size_t k = 0; k < uv.size(); ++k) {
    EXPECT_LT(coarse[k], 1);  // many points, few unknowns
    EXPECT_LE(coarse[k], fine[k] * (1 + 1e-9));
  }
}

TEST(Posterior, SamplesSpreadAsSigmaSays) {
  const Problem problem;
  const std::vector<double> sigma =
      PosteriorSigma(problem.view, problem.sd_mm, problem.terms, problem.uv);
  constexpr int kDraws = 700;
  const auto samples = PosteriorSamples(problem.view, problem.sd_mm, problem.terms, kDraws, 1);
  for (std::size_t k = 0; k < problem.uv.size(); ++k) {
    const Stencil s = problem.view.grid.StencilAt(problem.uv[k]);
    double squares = 0;
    for (const ControlNet& net : samples) {
      squares += (s.Apply(net) - s.Apply(problem.view.start)).squaredNorm() / 3 / kDraws;
    }
    EXPECT_NEAR(std::sqrt(squares), sigma[k], 0.06 * sigma[k]) << k;
  }
  const auto again = PosteriorSamples(problem.view, problem.sd_mm, problem.terms, 3, 1);
  EXPECT_EQ(again[2].vertices, samples[2].vertices);
  EXPECT_NE(PosteriorSamples(problem.view, problem.sd_mm, problem.terms, 1, 2)[0].vertices,
            samples[0].vertices);
}

// 90 % intervals of the fitted surface cover the true one nine times in ten.
TEST(Posterior, NinetyPercentIntervalsCoverNineInTen) {
  const Problem problem;
  const std::vector<double> sigma =
      PosteriorSigma(problem.view, problem.sd_mm, problem.terms, problem.uv);
  Random random(11);
  int inside = 0, all = 0;
  for (int draw = 0; draw < 150; ++draw) {
    const ControlNet truth = DrawTruth(problem, random);
    LevelView view = problem.view;
    for (std::size_t k = 0; k < view.observations.size(); ++k) {
      Observation& o = view.observations[k];
      const Vec3 noise(random.Normal(), random.Normal(), random.Normal());
      o.position = view.grid.StencilAt(o.uv).Apply(truth) + problem.sd_mm[k] * noise;
    }
    const ControlNet fitted = FitLevel(view, problem.terms, LevelSolver::kFastest).net;
    for (std::size_t k = 0; k < problem.uv.size(); ++k) {
      const Stencil s = view.grid.StencilAt(problem.uv[k]);
      const Vec3 off = s.Apply(fitted) - s.Apply(truth);
      for (int axis = 0; axis < 3; ++axis, ++all) {
        inside += std::abs(off[axis]) < 1.645 * sigma[k] ? 1 : 0;
      }
    }
  }
  EXPECT_GT(inside, 0.85 * all);
  EXPECT_LT(inside, 0.95 * all);
}

TEST(Posterior, WrongInputIsNamed) {
  Problem problem;
  const auto message = [&]() -> std::string {
    try {
      PosteriorSigma(problem.view, problem.sd_mm, problem.terms, problem.uv);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_EQ(message(), "no error");
  problem.terms.push_back(SymmetryTerm{});
  EXPECT_THAT(message(), ::testing::HasSubstr("'symmetry'"));
  problem.terms.pop_back();
  problem.sd_mm[3] = 0;
  EXPECT_THAT(message(), ::testing::HasSubstr("point 3 is 0 mm"));
  problem.sd_mm.pop_back();
  EXPECT_THAT(message(), ::testing::HasSubstr("24 standard deviations for 25 points"));
}

// Of places where the clean surface is known, and directions: the share whose error is within the
// interval that should hold 90 % of them. The points' deviation is taken from the residuals.
template <class Clean>
double Coverage(const Clean& clean, int count, double noise, const HSplineShape& shape,
                const SchedulePlan& plan) {
  const FitTarget target = testing::Scattered(clean, count, noise, 206);
  const HSplineSurface start = testing::PlainStart(shape);
  const std::vector<Term> terms = {PointTerm{}};
  const FitResult fit = Fit(start, target, {},
                            {.schedule = {{shape.max_level, 1}},
                             .terms = terms,
                             .plan = plan,
                             .solver = LevelSolver::kFastest},
                            {});
  const LevelSummary& last = fit.levels.back();
  const double sd = fit.point_rms_mm / std::sqrt(3 * (1 - last.rank / static_cast<double>(count)));
  Random random(3);
  std::vector<Vec2> uv;
  for (int k = 0; k < 1000; ++k) {
    uv.emplace_back(random.Uniform(0, 1), random.Uniform(0, 1));
  }
  const std::vector<double> sigma = PosteriorSigma(
      fit.surface, start, target, std::vector<double>(count, sd), last.level, terms, uv);
  int within = 0;
  for (std::size_t k = 0; k < uv.size(); ++k) {
    const Vec3 error = fit.surface.Point(uv[k]) - clean(uv[k]);
    within += static_cast<int>((error.array().abs() <= 1.645 * sigma[k]).count());
  }
  return within / 3000.0;
}

struct Scan {
  int count;
  double noise;
  int level;
  AdaptivePlan adaptive;
};

template <class Clean>
void ExpectCalibrated(const Clean& clean, const Scan& scan, Closure closure) {
  const auto coverage = [&](const SchedulePlan& plan, int finest) {
    return Coverage(clean, scan.count, scan.noise,
                    {.patches_u = 8, .patches_v = 8, .max_level = finest, .closure = closure},
                    plan);
  };
  for (const double share :
       {coverage(ListedPlan{}, scan.level), coverage(scan.adaptive, scan.adaptive.finest)}) {
    EXPECT_GT(share, 0.85);
    EXPECT_LT(share, 0.95);
  }
}

TEST(Posterior, NineInTenPlacesAreWithinTheirIntervalWhateverThePlan) {
  ExpectCalibrated(testing::FrankePoint, {10000, 1e-3, 2, {.tolerance_mm = 4e-3, .finest = 3}},
                   Closure::kOpen);
  ExpectCalibrated(testing::HeadPoint, {10000, 1e-4, 3, {.tolerance_mm = 4e-4, .finest = 4}},
                   Closure::kPeriodicU);
}

}  // namespace
}  // namespace semblance
