// SPDX-License-Identifier: GPL-3.0-or-later
// Laws that every term obeys. A new entry of the variant is covered without being named here.
#include "fitting/terms/term.h"

#include <ceres/crs_matrix.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "fitting/terms/term_cost.h"
#include "surfaces/base/error.h"
#include "tests/testing/level_views.h"

namespace semblance::fitting {
namespace {

using testing::AllTerms;
using testing::NoisyView;
using testing::Sheet;

// Half the cost and the Jacobian, evaluated by Ceres.
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
      constexpr double kStep_mm = 1e-4;  // not all residuals are linear
      plus.vertices[c / 3][c % 3] += kStep_mm;
      minus.vertices[c / 3][c % 3] -= kStep_mm;
      const std::vector<double> a = Residuals(term, view, plus), b = Residuals(term, view, minus);
      for (int r = 0; r < here.jacobian.rows(); ++r) {
        ASSERT_NEAR(here.jacobian(r, c), (a[r] - b[r]) / (2 * kStep_mm), 1e-7);
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
  const LevelSummary summary = FitLevel(view, std::vector<Term>{PointTerm{}}).summary;
  EXPECT_NEAR(std::pow(summary.rms_before_mm, 2), once, 1e-12 * once);
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
  // A flat sheet that slides within itself costs only the tangential part.
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

TEST(Terms, LandmarksAreThePointsThatAreLandmarks) {
  const LevelView view = NoisyView();
  LevelView alone = view;
  std::erase_if(alone.observations, [](const Observation& o) { return !o.landmark; });
  ASSERT_EQ(alone.observations.size(), 16u);
  const double points = TermCost(PointTerm{.weight = 3}, alone, view.start);
  EXPECT_NEAR(TermCost(LandmarkTerm{.weight = 3}, view, view.start), points, 1e-12 * points);
  EXPECT_GT(std::abs(TermCost(PointTerm{.weight = 3}, view, view.start) - points), 1e-3);
}

// The points disagree with the landmarks, and the surface comes nearer to the landmarks as their
// weight grows.
TEST(Terms, AHigherLandmarkWeightBringsTheSurfaceNearerToLandmarks) {
  LevelView view = NoisyView();
  for (Observation& o : view.observations) {
    o.position.z() += o.landmark ? 5 : 0;
  }
  double last = std::numeric_limits<double>::infinity();
  for (const double weight : {0.0, 0.1, 1.0, 1e4}) {
    const std::array<Term, 2> terms = {PointTerm{}, LandmarkTerm{.weight = weight}};
    const double misfit = TermCost(LandmarkTerm{}, view, FitLevel(view, terms).net);
    EXPECT_LT(misfit, 0.9 * last);
    last = misfit;
  }
  EXPECT_LT(last, 0.1);
}

TEST(Terms, ALandmarkTermWithoutLandmarksIsAnError) {
  LevelView view = NoisyView();
  for (Observation& o : view.observations) {
    o.landmark = false;
  }
  const std::array<Term, 2> terms = {PointTerm{}, LandmarkTerm{}};
  EXPECT_THROW(FitLevel(view, terms), InputError);
}

// The displacements are mirrored at the sheet's plane x = 40, and then all is rotated.
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

TEST(Terms, APriorOfHeldVerticesCountsThemAlone) {
  LevelView view = NoisyView();
  ControlNet net = view.start;
  view.held = {3, 8};
  for (const int k : {3, 8, 20}) {
    net.vertices[k] += Vec3(0, 3, 4);
  }
  const PriorTerm term{.weight = 2, .held_only = true};
  EXPECT_NEAR(TermCost(term, view, net), 2.0 * 2 * 25 / 42, 1e-12);
  EXPECT_EQ(TermCost(term, view, view.start), 0);
}

// The surface lies 2 standard deviations above the shape everywhere; shares and deviations are
// random.
TEST(Terms, APriorsShapeCostsWeightTimesSquaredDeviations) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 3, .max_level = 0};
  const HSplineSurface surface(shape, Sheet(4, 3, 2, 1));
  FitTarget target;
  Random random(3);
  for (int k = 0; k < 40; ++k) {
    const Vec2 uv(random.Uniform(0, 1), random.Uniform(0, 1));
    const double sd_mm = random.Uniform(0.5, 3);
    target.shape.push_back({.uv = uv,
                            .position = surface.Point(uv) - 2 * sd_mm * Vec3(0.6, 0, 0.8),
                            .sd_mm = sd_mm,
                            .share = random.Uniform(0.5, 2)});
  }
  const LevelView view = MakeLevelView(surface, surface, target, 0);
  EXPECT_NEAR(TermCost(PriorShapeTerm{.weight = 3}, view, view.start), 3 * 4, 1e-11);
}

TEST(Terms, AHigherPriorWeightKeepsTheShapeBetter) {
  const LevelView view = NoisyView();
  double last = std::numeric_limits<double>::infinity();
  for (const double weight : {0.0, 0.1, 10.0, 1e4}) {
    const std::array<Term, 2> terms = {PointTerm{}, PriorShapeTerm{.weight = weight}};
    const double misfit = TermCost(PriorShapeTerm{.weight = 1}, view, FitLevel(view, terms).net);
    EXPECT_LT(misfit, 0.9 * last);
    last = misfit;
  }
}

TEST(Terms, APriorShapeTermWithoutAShapeIsAnError) {
  LevelView view = NoisyView();
  view.likely.clear();
  const std::array<Term, 2> terms = {PointTerm{}, PriorShapeTerm{}};
  EXPECT_THROW(FitLevel(view, terms), InputError);
  FitTarget target{.points = {{.label = {}, .position = {0, 0, 0}, .uv = {0.5, 0.5}}}};
  EXPECT_NO_THROW(CheckTarget(target));
  target.shape = {{.uv = {0.5, 0.5}, .position = {0, 0, 0}, .sd_mm = 0}};
  EXPECT_THROW(CheckTarget(target), InputError);
}

TEST(Terms, NonPenetrationKeepsTheSurfaceOutsideTheBone) {
  LevelView view = NoisyView();
  for (BoneObservation& o : view.bone) {
    o.foot = view.grid.StencilAt(o.point.uv).Apply(view.start) - Vec3(0, 0, 3);
  }
  EXPECT_EQ(TermCost(NonPenetrationTerm{.min_depth_mm = 3 - 1e-9}, view, view.start), 0);
  EXPECT_NEAR(TermCost(NonPenetrationTerm{.weight = 2, .min_depth_mm = 5}, view, view.start), 8,
              1e-9);
  // The bone lies 1 mm above the points. They draw the surface in; the term keeps it 2 mm above the
  // bone.
  view.start = Sheet(4, 3, 0, 0);
  view.observations = testing::Observe(view.start, 320, 3);
  view.bone.clear();
  testing::StandOnBone(view);
  for (BoneObservation& o : view.bone) {
    o.foot = o.point.position + Vec3(0, 0, 1);
  }
  const auto height = [&](double weight) {
    const std::array<Term, 2> terms = {PointTerm{}, NonPenetrationTerm{.weight = weight}};
    const ControlNet net = FitLevel(view, terms).net;
    const Observation& o = view.observations[100];
    return view.grid.StencilAt(o.uv).Apply(net).z() - o.position.z();
  };
  EXPECT_NEAR(height(0), 0, 1e-6);
  EXPECT_NEAR(height(1), 1.5, 1e-6);
  EXPECT_NEAR(height(1e4), 3, 1e-3);
}

TEST(Terms, SpringsRestAtTheirDepthInEveryDirection) {
  LevelView view = NoisyView();
  for (BoneObservation& o : view.bone) {
    const Vec3 point = view.grid.StencilAt(o.point.uv).Apply(view.start);
    o.foot = point + Vec3(3, 4, 0);  // 5 mm from the surface, and from the point below
    o.point.position = o.foot + Vec3(0, 0, 5);
  }
  EXPECT_NEAR(TermCost(SpringTerm{}, view, view.start), 0, 1e-20);
  for (BoneObservation& o : view.bone) {
    o.point.position = o.foot + Vec3(0, 7, 0);
  }
  EXPECT_NEAR(TermCost(SpringTerm{.weight = 3}, view, view.start), 12, 1e-9);
  const std::array<Term, 2> terms = {SpringTerm{.weight = 1}, PriorTerm{.weight = 1e-6}};
  const LevelSolution solved = FitLevel(view, terms);
  EXPECT_LT(TermCost(SpringTerm{.weight = 1}, view, solved.net), 1e-3);
}

// A flat template is scaled, sheared or moved; the expected strains are computed by hand.
TEST(Terms, DistortionIsGreensStrain) {
  LevelView view = NoisyView();
  for (Vec3& v : view.rest.vertices) {
    v.z() = 0;
  }
  const auto cost = [&](const Mat3& map, DistortionOf of) {
    ControlNet net = view.rest;
    for (Vec3& v : net.vertices) {
      v = map * v + Vec3(1, 2, 3);
    }
    return TermCost(DistortionTerm{.weight = 1, .of = of, .length_mm = 1}, view, net);
  };
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).matrix();
  Mat3 shear = Mat3::Identity();
  shear(0, 1) = 0.2;
  for (const DistortionOf of : {DistortionOf::kMetric, DistortionOf::kArea}) {
    EXPECT_NEAR(cost(turn, of), 0, 1e-20);
  }
  EXPECT_NEAR(cost(1.1 * turn, DistortionOf::kMetric), 2 * std::pow(0.105, 2), 1e-12);
  EXPECT_NEAR(cost(1.1 * turn, DistortionOf::kArea), std::pow(0.21, 2), 1e-12);
  EXPECT_NEAR(cost(turn * shear, DistortionOf::kArea), 0, 1e-20);
  EXPECT_NEAR(cost(turn * shear, DistortionOf::kMetric), 0.02 + 0.0004, 1e-12);
  // The term keeps the template's lengths against points that stretch the surface.
  LevelView stretched = view;
  for (Observation& o : stretched.observations) {
    o.position = 1.2 * view.grid.StencilAt(o.uv).Apply(view.rest);
  }
  stretched.start = view.rest;
  const auto strain = [&](double weight) {
    const DistortionTerm term{.weight = weight, .length_mm = 10};
    const std::array<Term, 3> terms = {PointTerm{}, PriorTerm{.weight = 1e-6}, term};
    const ControlNet net = FitLevel(stretched, terms).net;
    return TermCost(DistortionTerm{.weight = 1, .length_mm = 1}, stretched, net);
  };
  EXPECT_LT(strain(100), 0.1 * strain(0));
}

TEST(Terms, BoneTermsNeedFeet) {
  LevelView view = NoisyView();
  view.bone.clear();
  for (const Term& term : {Term(SpringTerm{}), Term(NonPenetrationTerm{})}) {
    const std::array<Term, 2> terms = {PointTerm{}, term};
    EXPECT_THROW(FitLevel(view, terms), InputError);
  }
}

}  // namespace
}  // namespace semblance::fitting
