// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/shape_model/shape_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "problems/face/shape_model/shape_fit.h"
#include "problems/face/shape_model/shape_posterior.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr int kSide = 9;  // points along a side of the dome

// A dome 120 mm across that looks up, with four smooth modes.
ShapeModel Dome() {
  ShapeModel model;
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      const double x = 15.0 * i - 60, y = 15.0 * j - 60;
      model.mean.points.emplace_back(x, y, 60 - (x * x + y * y) / 120);
    }
  }
  for (int j = 0; j + 1 < kSide; ++j) {
    for (int i = 0; i + 1 < kSide; ++i) {
      const int a = i + kSide * j, b = a + 1, c = a + kSide, d = c + 1;
      model.mean.triangles.push_back({a, b, d});
      model.mean.triangles.push_back({a, d, c});
    }
  }
  model.modes.resize(3 * std::ssize(model.mean.points), 4);
  for (std::size_t v = 0; v < model.mean.points.size(); ++v) {
    const Vec3 p = model.mean.points[v] / 60;
    const Eigen::Index row = 3 * static_cast<Eigen::Index>(v);
    model.modes.block<3, 4>(row, 0) << 5 * p.x(), 0, p.y() * p.x(), 0,  //
        0, 3 * p.y(), 0, std::sin(2 * p.x()),                           //
        0, 4 * p.x() * p.x(), 3 * std::cos(2 * p.y()), 2 * p.x() * p.y();
  }
  return model;
}

Similarity SomePlace() {
  Similarity place;
  place.scale = 1.02;
  place.rotation = Eigen::AngleAxisd(0.3, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  place.translation = {10, -20, 5};
  return place;
}

ShapeTip TipAt(const ShapeModel& model, int triangle, const std::vector<Vec3>& shape) {
  ShapeTip tip{.label = "tip", .at = {triangle, {0.2, 0.3, 0.5}}};
  tip.position = FindPosition(tip.at, model.mean, shape);
  return tip;
}

std::vector<Vec3> Moved(std::vector<Vec3> points, const Similarity& to_from) {
  for (Vec3& p : points) {
    p = to_from * p;
  }
  return points;
}

double LargestDistance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double most = 0;
  for (std::size_t v = 0; v < a.size(); ++v) {
    most = std::max(most, (a[v] - b[v]).norm());
  }
  return most;
}

TEST(ShapeModel, InconsistentModelsAreRefused) {
  const auto fault = [](const ShapeModel& model) -> std::string {
    try {
      CheckShapeModel(model, "heads");
    } catch (const InputError& error) {
      return error.what();
    }
    return "none";
  };
  ShapeModel short_modes = Dome(), no_modes = Dome(), not_finite = Dome(), corner = Dome();
  EXPECT_EQ(fault(Dome()), "none");
  short_modes.modes.conservativeResize(30, 4);
  EXPECT_THAT(fault(short_modes), HasSubstr("heads: the modes move 30 coordinates, and the mean"));
  no_modes.modes.resize(no_modes.modes.rows(), 0);
  EXPECT_THAT(fault(no_modes), HasSubstr("needs triangles and modes"));
  not_finite.modes(3, 1) = kNaN;
  EXPECT_THAT(fault(not_finite), HasSubstr("not finite"));
  corner.mean.triangles[5][1] = 5000;
  EXPECT_THAT(fault(corner), HasSubstr("5000"));
  EXPECT_THROW(ShapeAt(Dome(), Eigen::VectorXd::Zero(3)), InputError);
}

TEST(SmoothField, FactorGivesTheCovarianceAtTheCentresAndLessElsewhere) {
  const ShapeModel model = Dome();
  const SmoothFieldOptions options;
  std::vector<int> centres;
  for (int v = 0; v < kSide * kSide; v += 7) {
    centres.push_back(v);
  }
  const std::vector<Vec3> features = {model.mean.points[40]};
  const Eigen::MatrixXd factor = SmoothFieldFactor(model.mean.points, centres, features, options);
  const auto covariance = [&](int v, int w) {
    const auto alpha = [&](int at) {
      const double mm = (model.mean.points[at] - features[0]).norm();
      return 0.5 + 0.5 * std::min(1.0, mm / 15);
    };
    const double d2 = (model.mean.points[v] - model.mean.points[w]).squaredNorm();
    return alpha(v) * alpha(w) *
           (4 * std::exp(-d2 / (2 * 45 * 45)) + std::exp(-d2 / (2 * 20 * 20)));
  };
  EXPECT_NEAR(factor.row(7).dot(factor.row(21)), covariance(7, 21), 1e-6);
  for (int v = 0; v < kSide * kSide; ++v) {
    EXPECT_LE(factor.row(v).squaredNorm(), covariance(v, v) + 1e-6);
  }
}

TEST(ShapeParameters, JacobianEqualsItsNumericTwin) {
  const ShapeModel model = Dome();
  const std::vector<int> centres = {0, 30, 60, 80};
  const Eigen::MatrixXd field = SmoothFieldFactor(model.mean.points, centres, {}, {});
  const ShapeFrame frame = CentredFrame(model);
  ShapeParameters parameters = StartParameters(frame, SomePlace(), model.Modes(), 4);
  Random random(3);
  const auto any_step = [&](double size) -> Eigen::VectorXd {
    return Eigen::VectorXd::NullaryExpr(parameters.size(),
                                        [&] { return random.Uniform(-size, size); });
  };
  parameters = MoveParameters(parameters, any_step(0.7));
  const ShapeRow row = PointRowAt(model, field, {12, {0.2, 0.3, 0.5}});
  const Vec3 direction = Vec3(1, -2, 3).normalized();
  ShapeDerivatives derivatives;
  PlacedPoint(frame, row, parameters, &derivatives);
  const Eigen::RowVectorXd exact = DerivativeAlong(direction, row, derivatives);
  ASSERT_EQ(exact.size(), parameters.size());
  for (Eigen::Index k = 0; k < exact.size(); ++k) {
    constexpr double kStep = 1e-5;
    const auto at = [&](double by) {
      const Eigen::VectorXd step = by * Eigen::VectorXd::Unit(parameters.size(), k);
      return direction.dot(PlacedPoint(frame, row, MoveParameters(parameters, step)));
    };
    EXPECT_NEAR(exact[k], (at(kStep) - at(-kStep)) / (2 * kStep), 1e-6);
  }
}

TEST(ShapeParameters, PartOfTheWayEndsAtBothEndsAndAddsUp) {
  const ShapeModel model = Dome();
  const ShapeFrame frame = CentredFrame(model);
  const ShapeParameters from = StartParameters(frame, SomePlace(), model.Modes(), 2);
  Eigen::VectorXd step = Eigen::VectorXd::LinSpaced(from.size(), -0.4, 0.9);
  const ShapeParameters to = MoveParameters(from, step);
  const auto apart = [](const ShapeParameters& a, const ShapeParameters& b) {
    return StepBetween(a.pose, b.pose).norm() + (a.coefficients - b.coefficients).norm() +
           (a.field - b.field).norm();
  };
  EXPECT_LT(apart(PartOfWay(from, to, 0), from), 1e-12);
  EXPECT_LT(apart(PartOfWay(from, to, 1), to), 1e-12);
  EXPECT_LT(apart(PartOfWay(PartOfWay(from, to, 0.5), to, 0.5), PartOfWay(from, to, 0.75)), 1e-12);
}

TEST(ShapeParameters, PlacedPointsAreTheShapeUnderTheSimilarity) {
  const ShapeModel model = Dome();
  const ShapeFrame frame = CentredFrame(model);
  ShapeParameters parameters = StartParameters(frame, SomePlace(), model.Modes(), 0);
  parameters.coefficients << 1, -0.5, 0.3, 2;
  const Eigen::MatrixXd no_field(std::ssize(model.mean.points), 0);
  EXPECT_LT(LargestDistance(PlacedPoints(frame, model, no_field, parameters),
                            Moved(ShapeAt(model, parameters.coefficients), SomePlace())),
            1e-9);
}

TEST(Whitening, IsTheInverseRootOfTheCovariance) {
  const PointSpread spread{.normal = Vec3(1, 2, 2) / 3,
                           .normal_sd_mm = 0.5,
                           .tangent_sd_mm = 4,
                           .direction = Vec3(0, 0.6, 0.8),
                           .along_sd_mm = 2};
  const Mat3 nn = spread.normal * spread.normal.transpose();
  const Mat3 c = 0.25 * nn + 16 * (Mat3::Identity() - nn) +
                 4 * spread.direction * spread.direction.transpose();
  const Mat3 w = MakeWhitening(spread);
  EXPECT_TRUE((w * c * w.transpose()).isIdentity(1e-12));
}

TEST(ShapeEstimate, WithoutObservationsItIsTheMeanPlaced) {
  const ShapeModel model = Dome();
  ShapeTarget target;
  target.start.translation = {3, 4, 5};
  const ShapeEstimate estimate = EstimateShape(model, target, {}, {});
  EXPECT_TRUE(estimate.usable);
  EXPECT_LT(LargestDistance(estimate.points, Moved(model.mean.points, target.start)), 1e-9);
  EXPECT_EQ(estimate.coefficients.norm(), 0);
}

TEST(ShapeEstimate, AShapeOfTheModelIsRecoveredFromExactPoints) {
  const ShapeModel model = Dome();
  Eigen::VectorXd truth(4);
  truth << 1.2, -0.8, 0.5, -1.5;
  const std::vector<Vec3> shape = Moved(ShapeAt(model, truth), SomePlace());
  ShapeTarget target{.start = {}, .tips = {}, .surface = nullptr, .features = {}};
  for (int t = 0; t < std::ssize(model.mean.triangles); ++t) {
    target.tips.push_back(TipAt(model, t, shape));
  }
  target.start.translation = {8, -15, 5};
  ShapeFitOptions options;
  options.tip_normal_sd_mm = options.tip_tangent_sd_mm = 1e-3;
  options.tip_loss_width = 1e6;
  options.rounds = 40;
  options.scale_sd = 10;
  options.field.centres = 0;
  const ShapeEstimate estimate = EstimateShape(model, target, options, {});
  EXPECT_LT(LargestDistance(estimate.points, shape), 1e-3);
  EXPECT_LT((estimate.coefficients - truth).norm(), 1e-3);
  EXPECT_NEAR(estimate.subject_from_model.scale, 1.02, 1e-4);
}

TEST(ShapeEstimate, TheSurfaceDrawsPointsFarFromTips) {
  const ShapeModel model = Dome();
  Eigen::VectorXd truth(4);
  truth << 0, 2, 1.5, 0;
  const TriMesh shape{ShapeAt(model, truth), model.mean.triangles};
  ShapeTarget target;
  for (const int t : {20, 60, 100}) {
    target.tips.push_back(TipAt(model, t, shape.points));
  }
  ShapeFitOptions options;
  options.surface_worth = 80;
  const auto error = [&](const TriMesh* surface) {
    target.surface = surface;
    return LargestDistance(EstimateShape(model, target, options, {}).points, shape.points);
  };
  EXPECT_LT(error(&shape), 0.7 * error(nullptr));
}

// The tips hold the shape on the mean; surface and bone are the mean, lifted and sunk.
TEST(ShapeEstimate, AFarSurfaceDrawsNoPointsThatAreNearerToBone) {
  const ShapeModel model = Dome();
  ShapeTarget target;
  for (int t = 0; t < std::ssize(model.mean.triangles); t += 4) {
    target.tips.push_back(TipAt(model, t, model.mean.points));
  }
  const auto at_height = [&](double z_mm) {
    TriMesh mesh = model.mean;
    for (Vec3& p : mesh.points) {
      p.z() += z_mm;
    }
    return mesh;
  };
  const auto drawn = [&](double surface_mm, double bone_mm) {
    const TriMesh surface = at_height(surface_mm), bone = at_height(bone_mm);
    target.surface = &surface;
    target.bone = std::isfinite(bone_mm) ? &bone : nullptr;
    return EstimateShape(model, target, {}, {}).surface_points;
  };
  EXPECT_GT(drawn(6, kNaN), 20);
  EXPECT_EQ(drawn(6, -2), 0);
  EXPECT_EQ(drawn(6, -40), drawn(6, kNaN));
  EXPECT_EQ(drawn(1, -0.2), drawn(1, kNaN));  // within the surface's deviation
}

TEST(ShapeEstimate, OneFarTipHasLittleEffect) {
  const ShapeModel model = Dome();
  ShapeTarget target;
  for (int t = 0; t < std::ssize(model.mean.triangles); t += 6) {
    target.tips.push_back(TipAt(model, t, model.mean.points));
  }
  target.tips[9].position.z() += 15;
  ShapeFitOptions robust, square;
  square.tip_loss_width = 1e6;
  const auto error = [&](const ShapeFitOptions& options) {
    return LargestDistance(EstimateShape(model, target, options, {}).points, model.mean.points);
  };
  EXPECT_LT(error(robust), 0.5 * error(square));
}

TEST(ShapeEstimate, ThreadsChangeNoByte) {
  const ShapeModel model = Dome();
  const TriMesh surface = Transformed(model.mean, SomePlace());
  ShapeTarget target{.start = SomePlace(), .tips = {}, .surface = &surface, .features = {}};
  target.tips.push_back(TipAt(model, 30, surface.points));
  RunContext threads;
  const ShapeEstimate one = EstimateShape(model, target, {}, threads);
  threads.threads = 4;
  const ShapeEstimate four = EstimateShape(model, target, {}, threads);
  EXPECT_EQ(one.points, four.points);
  EXPECT_EQ(one.sigma_mm, four.sigma_mm);
}

TEST(ShapeEstimate, ATipWithoutAPlaceIsRefused) {
  const ShapeModel model = Dome();
  ShapeTarget off_mesh, not_finite;
  off_mesh.tips = {{.label = "g", .at = {9999, {1, 0, 0}}, .position = {0, 0, 0}}};
  not_finite.tips = {{.label = "g", .at = {0, {1, 0, 0}}}};
  EXPECT_THROW(EstimateShape(model, off_mesh, {}, {}), InputError);
  EXPECT_THROW(EstimateShape(model, not_finite, {}, {}), InputError);
}

// The posterior of the dome at its mean, with observations at some of its points.
struct SeenDome {
  ShapeModel model = Dome();
  Eigen::MatrixXd field =
      SmoothFieldFactor(model.mean.points, std::vector<int>{0, 20, 40, 60, 80}, {}, {});
  ShapeFrame frame = CentredFrame(model);
  ShapeParameters parameters = StartParameters(frame, {}, model.Modes(), 5);

  std::vector<double> Sigma(const std::vector<int>& seen_vertices, double population_sd = 1) const {
    std::vector<ShapeObservation> seen;
    for (const int v : seen_vertices) {
      const PointSpread spread{.normal = Vec3::UnitZ(), .normal_sd_mm = 0.5, .tangent_sd_mm = 4};
      seen.push_back({.row = VertexRow(model, field, v),
                      .position = model.mean.points[v],
                      .whitening = MakeWhitening(spread),
                      .loss_width = 3});
    }
    return SigmaOf(seen, population_sd, 20);
  }

  // All points, upwards.
  std::vector<double> SigmaOf(const std::vector<ShapeObservation>& seen, double population_sd,
                              double smooth_length_mm) const {
    std::vector<ShapeRow> rows;
    for (int v = 0; v < kSide * kSide; ++v) {
      rows.push_back(VertexRow(model, field, v));
    }
    const std::vector<Vec3> up(rows.size(), Vec3::UnitZ());
    const ShapePosterior posterior =
        MakePosterior(frame, parameters, seen, {.population_sd = population_sd}, smooth_length_mm);
    return DeviationsAlong(frame, parameters, posterior, rows, up, 1);
  }
};

TEST(ShapePosterior, AnObservationNeverRaisesSigmaAndLowersItWhereItIs) {
  const SeenDome dome;
  std::vector<int> seen;
  std::vector<double> before = dome.Sigma(seen);
  for (const int v : {40, 4, 76, 10, 62, 40}) {
    seen.push_back(v);
    const std::vector<double> after = dome.Sigma(seen);
    for (std::size_t k = 0; k < after.size(); ++k) {
      EXPECT_LE(after[k], before[k] * (1 + 1e-9));
    }
    EXPECT_LT(after[v], before[v]);
    EXPECT_LE(after[v], 0.5);
    before = after;
  }
}

TEST(ShapePosterior, WithoutObservationsItIsThePrior) {
  const SeenDome dome;
  const std::vector<double> sigma = dome.Sigma({});
  const int v = 40;  // the top of the dome, right above the centre
  const Vec3 arm = dome.model.mean.points[v] - dome.frame.centre;
  const double modes = dome.model.modes.row(3 * v + 2).squaredNorm();
  const double pose = std::pow(0.03 * arm.z(), 2) + std::pow(100, 2) + arm.head<2>().squaredNorm();
  const double rest = pose + dome.field.row(v).squaredNorm();
  EXPECT_NEAR(sigma[v], std::sqrt(modes + rest), 1e-6);
  EXPECT_NEAR(dome.Sigma({}, 3)[v], std::sqrt(9 * modes + rest), 1e-6);
}

// A wider population raises sigma where there are no observations, and not where there are many.
TEST(ShapePosterior, AWiderPopulationRaisesSigmaWithoutObservations) {
  const SeenDome dome;
  const std::vector<int> seen = {0, 1, 2, 9, 10, 11, 18, 19, 20};  // a corner
  const std::vector<double> one = dome.Sigma(seen, 1), two = dome.Sigma(seen, 2);
  EXPECT_LT(two[10], 1.1 * one[10]);
  EXPECT_GT(two[80], 1.5 * one[80]);
}

// A shared error of all tips adds the square of the estimate's move to the variance.
TEST(ShapePosterior, ASharedErrorAddsTheSquaredMoveOfTheEstimate) {
  const ShapeModel model = Dome();
  ShapeTarget target;
  for (int t = 0; t < std::ssize(model.mean.triangles); t += 5) {
    target.tips.push_back(TipAt(model, t, model.mean.points));
    target.tips.back().direction = Vec3::UnitZ();
    target.tips.back().along_sd_mm = 2;
  }
  ShapeFitOptions options;
  options.tip_loss_width = 1e6;
  options.rounds = 40;
  const ShapeEstimate before = EstimateShape(model, target, options, {});
  ShapeTarget shared = target, moved = target;
  for (std::size_t k = 0; k < target.tips.size(); ++k) {
    const double mm = 0.5 + 0.1 * static_cast<double>(k % 3);
    shared.tips[k].shared_sd_mm = mm;
    moved.tips[k].position.z() += mm;
  }
  const ShapeEstimate wide = EstimateShape(model, shared, options, {});
  const ShapeEstimate after = EstimateShape(model, moved, options, {});
  EXPECT_EQ(wide.points, before.points);
  const std::vector<Vec3> normals = VertexNormals(TriMesh{before.points, model.mean.triangles});
  for (std::size_t v = 0; v < normals.size(); ++v) {
    const double added = std::pow(wide.sigma_mm[v], 2) - std::pow(before.sigma_mm[v], 2);
    const double way = (after.points[v] - before.points[v]).dot(normals[v]);
    EXPECT_NEAR(std::sqrt(std::max(added, 0.0)), std::abs(way), 0.04) << v;
  }
}

// Smooth errors with an infinite correlation length equal one shared error; with length zero they
// are independent.
TEST(ShapePosterior, SmoothErrorsLieBetweenOneForEachAndOneForAll) {
  const SeenDome dome;
  const auto sigma = [&](double smooth_length_mm, const std::vector<int>& sharing) {
    std::vector<ShapeObservation> seen;
    for (const int v : {12, 22, 40, 41, 66}) {
      seen.push_back({.row = VertexRow(dome.model, dome.field, v),
                      .position = dome.model.mean.points[v],
                      .whitening = Vec3::UnitZ().transpose() / 2,
                      .loss_width = 3,
                      .weight = 0.3,
                      .smooth_sd_mm = 2.5});
      if (std::ranges::find(sharing, v) != sharing.end()) {
        seen.back().shared_mm = 2.5 * Vec3::UnitZ();
      }
    }
    return dome.SigmaOf(seen, 1, smooth_length_mm);
  };
  const double none_mm = 1e-3, any_mm = 1e6;
  const std::vector<double> own = sigma(none_mm, {}), one = sigma(any_mm, {}),
                            all = sigma(none_mm, {12, 22, 40, 41, 66}), between = sigma(20, {});
  std::vector<double> expected;
  for (std::size_t v = 0; v < own.size(); ++v) {
    expected.push_back(all[v] * all[v]);
  }
  for (const int v : {12, 22, 40, 41, 66}) {  // the same error once as its own, once as shared
    const std::vector<double> shares = sigma(none_mm, {v});
    for (std::size_t k = 0; k < own.size(); ++k) {
      expected[k] -= shares[k] * shares[k] - own[k] * own[k];
    }
  }
  for (std::size_t v = 0; v < own.size(); ++v) {
    EXPECT_NEAR(one[v] * one[v], expected[v], 1e-6 * expected[v]) << v;
  }
  EXPECT_GT(between[40], own[40]);
  EXPECT_LT(between[40], one[40]);
}

// Draws scatter about the most likely shape with sigma.
TEST(ShapePosterior, DrawsHaveTheSpreadOfSigma) {
  constexpr int kDraws = 600;
  const ShapeModel model = Dome();
  const TriMesh surface{model.mean.points, model.mean.triangles};
  ShapeTarget target;
  target.surface = &surface;
  for (int t = 0; t < std::ssize(model.mean.triangles); t += 9) {
    target.tips.push_back(TipAt(model, t, model.mean.points));
    target.tips.back().direction = Vec3::UnitZ();
    target.tips.back().shared_sd_mm = 1;
  }
  for (int k = 1; k <= kDraws; ++k) {
    target.draws.push_back(k);
  }
  ShapeFitOptions options;
  options.discrepancy_mm = options.unseen_rate = 0;
  options.field.centres = 20;
  options.population_sd = 1.5;
  const ShapeEstimate estimate = EstimateShape(model, target, options, {});
  ASSERT_EQ(estimate.drawn.size(), kDraws);
  const std::vector<Vec3> normals = VertexNormals(TriMesh{estimate.points, model.mean.triangles});
  for (const std::size_t v : {20u, 40u, 44u, 58u}) {  // none at the open border
    double squares = 0;
    for (const std::vector<Vec3>& drawn : estimate.drawn) {
      squares += std::pow((drawn[v] - estimate.points[v]).dot(normals[v]), 2);
    }
    EXPECT_NEAR(std::sqrt(squares / kDraws) / estimate.sigma_mm[v], 1, 0.12) << v;
  }
  target.draws = {7};
  EXPECT_EQ(EstimateShape(model, target, options, {}).drawn.front(), estimate.drawn[6]);
}

// The additional part of sigma grows with the distance from the nearest tip, and moves no point.
TEST(ShapePosterior, SigmaGrowsWhereNoTipIsNear) {
  const ShapeModel model = Dome();
  ShapeTarget target;
  for (const int t : {0, 1, 2, 3, 17, 33}) {
    target.tips.push_back(TipAt(model, t, model.mean.points));
  }
  ShapeFitOptions modes_alone, unseen;
  modes_alone.unseen_rate = 0;
  unseen.unseen_rate = 0.3;
  unseen.unseen_reach_mm = 25;
  const ShapeEstimate before = EstimateShape(model, target, modes_alone, {});
  const ShapeEstimate after = EstimateShape(model, target, unseen, {});
  EXPECT_EQ(before.points, after.points);
  for (std::size_t v = 0; v < before.points.size(); ++v) {
    double nearest = 1e9;
    for (const ShapeTip& tip : target.tips) {
      nearest = std::min(nearest, (tip.position - model.mean.points[v]).norm());
    }
    const double added = std::pow(after.sigma_mm[v], 2) - std::pow(before.sigma_mm[v], 2);
    EXPECT_NEAR(std::sqrt(std::max(added, 0.0)), 0.3 * std::max(0.0, nearest - 25), 1e-6) << v;
  }
}

}  // namespace
}  // namespace semblance::problems
