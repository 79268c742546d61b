// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "fitting/fit.h"
#include "fitting/uncertainty/error_propagation.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/adaptive_coverage.h"
#include "tests/testing/scattered_data.h"
#include "tests/testing/splines.h"

namespace semblance::fitting {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Points of the template in the part u < 0.7, with correlated errors along its normals.
struct Scene {
  HSplineSurface rest = testing::SmoothSurface({.patches_u = 4, .patches_v = 3, .max_level = 1}, 1);
  FitTarget target;
  PointErrors errors;
  std::vector<Term> terms = {PointTerm{}, SmoothnessTerm{.weight = 0.05},
                             MembraneTerm{.weight = 0.2}};
  std::vector<Vec2> uv = {{0.1, 0.2}, {0.35, 0.5}, {0.6, 0.8}, {0.95, 0.5}};
  std::vector<Vec3> normals;

  Scene() {
    Random random(5);
    for (int k = 0; k < 90; ++k) {
      const Vec2 at(random.Uniform(0, 0.7), random.Uniform(0, 1));
      target.points.push_back(
          {.label = "p", .position = rest.Point(at), .uv = at, .weight = random.Uniform(0.5, 2)});
      errors.directions.push_back(rest.Normal(at));
    }
    errors.root.resize(90, 4);
    for (int k = 0; k < 90; ++k) {
      const Vec2& at = target.points[k].uv;
      errors.root.row(k) << 1, 2 * at.x(), std::sin(6 * at.y()), random.Uniform(-0.5, 0.5);
    }
    for (const Vec2& at : uv) {
      normals.push_back(rest.Normal(at));
    }
  }

  FitTarget Off(Random& random) const {
    Eigen::VectorXd z(errors.root.cols());
    for (double& value : z) {
      value = random.Normal();
    }
    const Eigen::VectorXd along = errors.root * z;
    FitTarget off = target;
    for (std::size_t k = 0; k < off.points.size(); ++k) {
      off.points[k].position += along[static_cast<Eigen::Index>(k)] * errors.directions[k];
    }
    return off;
  }

  HSplineSurface Fitted(const FitTarget& points) const {
    return Fit(rest, points, {},
               {.plan = ListedPlan{.schedule = {{.level = 1, .fraction = 1}}},
                .terms = terms,
                .solver = Solver::kFastest},
               {})
        .surface;
  }

  ErrorPropagation Spread(const HSplineSurface& surface, const FitTarget& points) const {
    return {surface, rest, points, 1, terms, errors};
  }
};

// Repeated fits to points with drawn errors deviate from the surface by sigma.
TEST(ErrorPropagation, SigmaIsTheDeviationOfTheFitWhereThereArePoints) {
  const Scene scene;
  const std::vector<double> sigma =
      scene.Spread(scene.rest, scene.target).Sigma(scene.uv, scene.normals);
  Random random(7);
  constexpr int kDraws = 500;  // the estimate's own deviation is 3 %
  std::vector<double> squares(scene.uv.size(), 0);
  for (int draw = 0; draw < kDraws; ++draw) {
    const HSplineSurface fitted = scene.Fitted(scene.Off(random));
    for (std::size_t k = 0; k < scene.uv.size(); ++k) {
      const Vec3 off = fitted.Point(scene.uv[k]) - scene.rest.Point(scene.uv[k]);
      squares[k] += std::pow(off.dot(scene.normals[k]), 2) / kDraws;
    }
  }
  for (std::size_t k = 0; k < scene.uv.size(); ++k) {
    EXPECT_NEAR(std::sqrt(squares[k]), sigma[k], 0.1 * sigma[k]) << k;
  }
}

TEST(ErrorPropagation, SamplesHaveTheSpreadOfSigma) {
  Scene scene;
  Random random(3);
  const FitTarget off = scene.Off(random);
  const HSplineSurface fitted = scene.Fitted(off);
  const ErrorPropagation spread = scene.Spread(fitted, off);
  EXPECT_GT(spread.prior_sd(), 0);
  for (std::size_t k = 0; k < scene.uv.size(); ++k) {
    scene.normals[k] = fitted.Normal(scene.uv[k]);
  }
  const std::vector<double> sigma = spread.Sigma(scene.uv, scene.normals);
  constexpr int kDraws = 500;
  const std::vector<HSplineSurface> samples = spread.Samples(kDraws, 1);
  for (std::size_t k = 0; k < scene.uv.size(); ++k) {
    double squares = 0;
    for (const HSplineSurface& sample : samples) {
      const Vec3 away = sample.Point(scene.uv[k]) - fitted.Point(scene.uv[k]);
      squares += std::pow(away.dot(scene.normals[k]), 2) / kDraws;
    }
    EXPECT_NEAR(std::sqrt(squares), sigma[k], 0.1 * sigma[k]) << k;
  }
  EXPECT_EQ(spread.Samples(2, 1)[1].Net(1).vertices, samples[1].Net(1).vertices);
  // Draws of another random_seed are independent, so their difference has twice the variance.
  const std::vector<HSplineSurface> others = spread.Samples(kDraws, 2);
  double squares = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Vec3 apart = others[draw].Point(scene.uv[1]) - samples[draw].Point(scene.uv[1]);
    squares += std::pow(apart.dot(scene.normals[1]), 2) / kDraws;
  }
  EXPECT_NEAR(std::sqrt(squares / 2), sigma[1], 0.1 * sigma[1]);
}

// Gauss and Markov's variance, dense: s' (A' C^-1 A)^-1 s, with s the stencil at a place, A those
// of the points and C the diagonal of their variances.
double GaussMarkovSigma(const HSplineSurface& surface, const FitTarget& target,
                        const Eigen::VectorXd& sd_mm, const Vec2& uv) {
  const auto row = [&](const Vec2& at) {
    Eigen::VectorXd dense = Eigen::VectorXd::Zero(surface.Columns(0) * surface.Rows(0));
    const Stencil stencil = surface.StencilAt(0, at);
    for (int k = 0; k < 16; ++k) {
      dense[stencil.index[k]] += stencil.weight[k];
    }
    return dense;
  };
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(row(uv).size(), row(uv).size());
  for (std::size_t k = 0; k < target.points.size(); ++k) {
    const Eigen::VectorXd a = row(target.points[k].uv) / sd_mm[static_cast<Eigen::Index>(k)];
    normal += a * a.transpose();
  }
  return std::sqrt(row(uv).dot(normal.ldlt().solve(row(uv))));
}

// The only terms are points with independent errors and matching weights.
TEST(ErrorPropagation, OfIndependentPointsIsThatOfGaussAndMarkov) {
  const HSplineSurface rest = testing::SmoothSurface({.patches_u = 4, .patches_v = 3}, 1);
  Random random(6);
  FitTarget target;
  Eigen::VectorXd sd_mm(200);
  PointErrors errors;
  for (double& sd : sd_mm) {
    sd = random.Uniform(0.5, 2);
    const Vec2 at(random.Uniform(0, 1), random.Uniform(0, 1));
    target.points.push_back(
        {.label = {}, .position = rest.Point(at), .uv = at, .weight = 7 / (sd * sd)});
    errors.directions.push_back(Vec3::UnitZ());
  }
  errors.root = sd_mm.asDiagonal();
  const std::vector<Term> terms = {PointTerm{}};
  const std::vector<Vec2> uv = {{0.1, 0.2}, {0.35, 0.5}, {0.6, 0.8}, {0.95, 0.5}};
  const std::vector<double> sigma = ErrorPropagation(rest, rest, target, 0, terms, errors)
                                        .Sigma(uv, std::vector<Vec3>(4, Vec3::UnitZ()));
  for (std::size_t k = 0; k < uv.size(); ++k) {
    const double expected = GaussMarkovSigma(rest, target, sd_mm, uv[k]);
    EXPECT_NEAR(sigma[k], expected, 1e-4 * expected);  // the factor has a small ridge
  }
}

// Errors that neighbours share are not averaged away; independent errors are.
TEST(ErrorPropagation, CorrelatedErrorsCountInFull) {
  Scene scene;
  scene.uv.pop_back();  // where there are points
  scene.normals.pop_back();
  scene.errors.root = Eigen::MatrixXd::Constant(90, 1, 2.0);
  const std::vector<double> together =
      scene.Spread(scene.rest, scene.target).Sigma(scene.uv, scene.normals);
  scene.errors.root = 2.0 * Eigen::MatrixXd::Identity(90, 90);
  const std::vector<double> apart =
      scene.Spread(scene.rest, scene.target).Sigma(scene.uv, scene.normals);
  for (std::size_t k = 0; k < scene.uv.size(); ++k) {
    EXPECT_NEAR(together[k], 2, 0.3);
    EXPECT_LT(apart[k], 0.7 * together[k]);
  }
}

// Where there is no point, the surface follows the template. If the points bend the template more,
// sigma is larger there.
TEST(ErrorPropagation, WithoutPointsTheOtherTermsDetermineSigma) {
  Scene scene;
  scene.errors.root.setZero();
  const auto sigma = [&](double bend_mm) {
    FitTarget bent = scene.target;
    for (FitPoint& p : bent.points) {
      p.position += Vec3(0, 0, bend_mm * std::sin(9 * p.uv.x()));
    }
    return scene.Spread(scene.Fitted(bent), bent).Sigma(scene.uv, scene.normals);
  };
  const std::vector<double> little = sigma(1), much = sigma(5);
  EXPECT_GT(little.back(), 2 * little.front());
  EXPECT_NEAR(much.back(), 5 * little.back(), 0.02 * much.back());
}

TEST(ErrorPropagation, StepsNotTakenCountAsADeviation) {
  Scene scene;
  scene.errors.root.setZero();
  FitTarget shifted = scene.target;
  for (FitPoint& p : shifted.points) {
    p.position += Vec3(0, 0, 3);
  }
  const std::vector<double> sigma =
      scene.Spread(scene.rest, shifted).Sigma(scene.uv, scene.normals);
  for (std::size_t k = 0; k < scene.uv.size(); ++k) {
    EXPECT_NEAR(sigma[k], 3 * std::abs(scene.normals[k].z()), 1e-6);
  }
}

TEST(ErrorPropagation, APointWithoutPullHasNoEffect) {
  Scene scene;
  scene.terms[0] = PointTerm{};
  const std::vector<double> without =
      scene.Spread(scene.rest, scene.target).Sigma(scene.uv, scene.normals);
  double sum = 0;
  for (const FitPoint& p : scene.target.points) {
    sum += p.weight;
  }
  scene.target.points.push_back({"far", scene.rest.Point({0.3, 0.3}) + Vec3(90, 0, 0), {0.3, 0.3}});
  scene.errors.directions.push_back(Vec3::UnitX());
  scene.errors.root.conservativeResize(91, Eigen::NoChange);
  scene.errors.root.row(90).setConstant(70);
  scene.terms[0] =
      PointTerm{.weight = (sum + 1) / sum, .loss = RobustLoss::kTukey, .loss_width_mm = 20};
  const std::vector<double> tamed =
      scene.Spread(scene.rest, scene.target).Sigma(scene.uv, scene.normals);
  for (std::size_t k = 0; k < scene.uv.size(); ++k) {
    EXPECT_NEAR(tamed[k], without[k], 1e-9);
  }
}

// Repeated fits to drawn noise on the same vertices, some of them finer.
TEST(ErrorPropagation, OfAnAdaptiveFitIsTheDeviationByItsNoise) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 2};
  constexpr double kNoise_mm = 0.01;
  constexpr int kCount = 800;
  const auto bump = [](const Vec2& uv) {
    return Vec3(uv.x(), uv.y(), 0.1 * std::exp(-(uv - Vec2(0.7, 0.3)).squaredNorm() / 0.02));
  };
  const FitTarget clean = testing::Scattered(bump, kCount, 0, 9);
  const HSplineSurface rest = testing::PlainStart(shape);
  const auto fitted = [&](const HSplineSurface& start, const FitTarget& target, double tolerance) {
    const AdaptivePlan plan{.tolerance_mm = tolerance, .finest = 2};
    return Fit(start, rest, target, {},
               {.plan = plan, .terms = {PointTerm{}}, .solver = Solver::kFastest}, {})
        .surface;
  };
  const HSplineSurface surface = fitted(rest, clean, 1e-2);
  ASSERT_FALSE(surface.Offsets(1).empty());
  ASSERT_LT(static_cast<int>(surface.Offsets(1).size()), surface.Columns(1) * surface.Rows(1));
  PointErrors errors{std::vector<Vec3>(kCount, Vec3::UnitZ()),
                     kNoise_mm * Eigen::MatrixXd::Identity(kCount, kCount)};
  const int level = surface.Offsets(2).empty() ? 1 : 2;
  const std::vector<Vec2> uv = {{0.2, 0.3}, {0.45, 0.5}, {0.7, 0.3}, {0.72, 0.4}};
  const ErrorPropagation spread(surface, rest, clean, level, std::vector<Term>{PointTerm{}},
                                errors);
  const std::vector<double> sigma = spread.Sigma(uv, std::vector<Vec3>(4, Vec3::UnitZ()));
  Random random(7);
  constexpr int kDraws = 200;  // the estimate's own deviation is 5 %
  std::vector<double> squares(uv.size(), 0), sampled(uv.size(), 0);
  const std::vector<HSplineSurface> samples = spread.Samples(kDraws, 1);
  for (int draw = 0; draw < kDraws; ++draw) {
    FitTarget noisy = clean;
    for (FitPoint& p : noisy.points) {
      p.position.z() += kNoise_mm * random.Normal();
    }
    const HSplineSurface other = fitted(surface, noisy, 1e3);
    for (std::size_t k = 0; k < uv.size(); ++k) {
      const double here = surface.Point(uv[k]).z();
      squares[k] += std::pow(other.Point(uv[k]).z() - here, 2) / kDraws;
      sampled[k] += std::pow(samples[draw].Point(uv[k]).z() - here, 2) / kDraws;
    }
  }
  for (std::size_t k = 0; k < uv.size(); ++k) {
    EXPECT_NEAR(std::sqrt(squares[k]), sigma[k], 0.15 * sigma[k]) << k;
    EXPECT_NEAR(std::sqrt(sampled[k]), sigma[k], 0.15 * sigma[k]) << k;
  }
}

// With a tolerance as small as the noise there are enough vertices, and only the noise is left.
// With a tolerance several times as large, the intervals do not cover the detail that the vertices
// cannot follow.
TEST(ErrorPropagation, IntervalsOfAnAdaptiveFitHoldForAToleranceOfTheNoise) {
  const double fine = testing::AdaptiveCoverage(1, 16), coarse = testing::AdaptiveCoverage(5, 4);
  EXPECT_GT(fine, 0.88);
  EXPECT_LT(fine, 0.92);
  EXPECT_LT(coarse, fine);
}

TEST(ErrorPropagation, IsNaNWhereNothingDeterminesTheSurface) {
  Scene scene;
  scene.terms = {PointTerm{}};
  const std::vector<double> sigma =
      scene.Spread(scene.rest, scene.target).Sigma(scene.uv, scene.normals);
  EXPECT_TRUE(std::isfinite(sigma[0]));
  EXPECT_TRUE(std::isnan(sigma[3]));
}

TEST(ErrorPropagation, CoupledTermsAreLeftOutByName) {
  Scene scene;
  scene.terms.push_back(SymmetryTerm{});
  scene.terms.push_back(SymmetryTerm{.weight = 0});
  EXPECT_THAT(scene.Spread(scene.rest, scene.target).left_out(), ElementsAre("symmetry"));
}

TEST(ErrorPropagation, WrongInputIsNamed) {
  Scene scene;
  const auto message = [&]() -> std::string {
    try {
      scene.Spread(scene.rest, scene.target);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_EQ(message(), "no error");
  scene.terms = {SmoothnessTerm{}};
  EXPECT_THAT(message(), HasSubstr("no point has a weight"));
  scene.terms = {PointTerm{}};
  scene.errors.directions.pop_back();
  EXPECT_THAT(message(), HasSubstr("89 directions"));
}

TEST(PivotedRoot, ReproducesTheMatrixToItsShare) {
  Eigen::MatrixXd covariance(60, 60);
  for (int i = 0; i < 60; ++i) {
    for (int j = 0; j < 60; ++j) {
      covariance(i, j) = 4 * std::exp(-std::pow((i - j) / 12.0, 2));
    }
  }
  const Eigen::MatrixXd root = PivotedRoot(covariance);
  EXPECT_LT(root.cols(), 20);
  const Eigen::MatrixXd left = covariance - root * root.transpose();
  EXPECT_LT(left.cwiseAbs().maxCoeff(), 4e-3);
  EXPECT_EQ(PivotedRoot(Eigen::MatrixXd::Zero(5, 5)).cols(), 0);
}

}  // namespace
}  // namespace semblance::fitting
