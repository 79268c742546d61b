// SPDX-License-Identifier: GPL-3.0-or-later
// Depth as a Matern field along the bone, compared with dense matrices, and the means of processes.
#include "interp/kriging/surface_matern.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <array>

#include "interp/interpolate_depth.h"
#include "interp/kriging/gaussian_regression.h"
#include "interp/on_surface/bone_geometry.h"
#include "interp/on_surface/coarse_surface.h"
#include "interp/on_surface/matern_field.h"
#include "surfaces/base/error.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::Count;
using testing::DowelScene;
using testing::Joined;
using testing::Plate;
using testing::ScatteredScene;
using testing::SphereMesh;

// Dowels at vertices of a coarse sphere, one of them uncertain.
DowelScene SmallScene() {
  DowelScene scene;
  scene.skull = SphereMesh({0, 0, 0}, 60, 9);
  scene.normals = VertexNormals(scene.skull);
  const std::vector<int> at = {0, 20, 45, 77, 90, 113, 131};
  for (std::size_t k = 0; k < at.size(); ++k) {
    const Vec3& base = scene.skull.points[at[k]];
    scene.dowels.push_back({"d" + std::to_string(k), base, base.normalized(),
                            8 + std::sin(3.0 * static_cast<double>(k)) + base.z() / 30, kNaN});
  }
  scene.dowels[2].sd_mm = 0.7;
  return scene;
}

std::vector<Eigen::Index> VerticesOf(const DowelScene& scene) {
  std::vector<Eigen::Index> vertices;
  for (const Dowel& dowel : scene.dowels) {
    vertices.push_back(std::ranges::find(scene.skull.points, dowel.base) -
                       scene.skull.points.begin());
  }
  return vertices;
}

// Correlations of all vertices from the definition. half_at_mm: half_at_relief_mm, or 1e300 for
// none.
Eigen::MatrixXd DenseCorrelations(const TriMesh& mesh, int alpha, double length_mm,
                                  double half_at_mm = 1e300) {
  const MeshLaplacian laplacian = BuildLaplacian(mesh);
  const double kappa = MaternKappa(alpha, length_mm);
  const Eigen::ArrayXd relief = BoneRelief(mesh, std::array{40.0}).row(0).transpose().array();
  const Eigen::MatrixXd area =
      (laplacian.area_mm2.array() * (1 + relief.abs() / half_at_mm).square()).matrix().asDiagonal();
  const Eigen::MatrixXd k = kappa * kappa * area + Eigen::MatrixXd(laplacian.stiffness);
  Eigen::MatrixXd precision = k;
  for (int power = 1; power < alpha; ++power) {
    precision = precision * area.inverse() * k;
  }
  const Eigen::MatrixXd covariance = precision.inverse();
  const Eigen::VectorXd root = covariance.diagonal().cwiseSqrt().cwiseInverse();
  return root.asDiagonal() * covariance * root.asDiagonal();
}

class EveryAlpha : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(SurfaceMatern, EveryAlpha, ::testing::Values(1, 2, 3));

// The mean as a further Gaussian unknown with a huge variance, conditioned with dense matrices.
void ExpectPosterior(const DepthField& field, const DowelScene& scene,
                     const Eigen::MatrixXd& correlations) {
  constexpr double kVague = 1e4;
  const Eigen::MatrixXd prior = 1.5 * 1.5 * correlations.array() + kVague;
  const std::vector<Eigen::Index> at = VerticesOf(scene);
  Eigen::MatrixXd of_dowels = prior(at, at);
  of_dowels(2, 2) += 0.49;
  Eigen::VectorXd depth(std::ssize(at));
  for (Eigen::Index k = 0; k < depth.size(); ++k) {
    depth[k] = scene.dowels[static_cast<std::size_t>(k)].depth_mm;
  }
  const Eigen::MatrixXd gain = prior(Eigen::all, at) * of_dowels.inverse();
  const Eigen::VectorXd mean = gain * (depth.array() - 8).matrix();
  const Eigen::MatrixXd posterior = prior - gain * prior(at, Eigen::all);
  for (Eigen::Index v = 0; v < mean.size(); ++v) {
    ASSERT_NEAR(field.depth_mm[static_cast<std::size_t>(v)], 8 + mean[v], 1e-3);
    const double sd = field.sd_mm[static_cast<std::size_t>(v)];
    ASSERT_NEAR(sd * sd, posterior(v, v), 1e-3);
  }
}

TEST_P(EveryAlpha, DepthAndSdAreThePosteriorOfDenseMatrices) {
  DowelScene scene = SmallScene();
  SurfaceMatern options{.alpha = GetParam(),
                        .length_mm = 40,
                        .signal_mm = 1.5,
                        .edge_mm = 0,
                        .clamp = false,
                        .max_angle_deg = 180};
  ExpectPosterior(InterpolateDepth(options, scene.Input(), RunContext{}), scene,
                  DenseCorrelations(scene.skull, GetParam(), 40));
  options.half_at_relief_mm = 12;
  ExpectPosterior(InterpolateDepth(options, scene.Input(), RunContext{}), scene,
                  DenseCorrelations(scene.skull, GetParam(), 40, 12));
}

SurfaceMaternData SurfaceData(const DowelScene& scene) {
  const auto n = std::ssize(scene.dowels);
  SurfaceMaternData data{Eigen::VectorXd(n), Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Ones(n, 1)};
  for (Eigen::Index k = 0; k < n; ++k) {
    const Dowel& dowel = scene.dowels[static_cast<std::size_t>(k)];
    data.depth_mm[k] = dowel.depth_mm;
    data.nugget_mm2[k] = std::isfinite(dowel.sd_mm) ? dowel.sd_mm * dowel.sd_mm : 0;
  }
  return data;
}

ReducedMatern CorrelationsOf(const DowelScene& scene, const SurfaceMatern& options) {
  const MaternDomain domain{scene.skull.points, BuildLaplacian(scene.skull)};
  const std::vector<Eigen::Index> at = VerticesOf(scene);
  const Eigen::MatrixXd weights = Eigen::MatrixXd::Identity(
      std::ssize(scene.skull.points), std::ssize(scene.skull.points))(Eigen::all, at);
  return {domain, weights, SearchPoles(options), {}};
}

// Minus twice the log density of all contrasts of the depths, which do not depend on the mean.
TEST_P(EveryAlpha, CostIsTheGaussianDensityOfTheContrasts) {
  const DowelScene scene = SmallScene();
  const SurfaceMatern options{.alpha = GetParam(), .length_prior_spread = 1e9, .fit_nugget = true};
  const ReducedMatern correlations = CorrelationsOf(scene, options);
  const SurfaceMaternData data = SurfaceData(scene);
  const auto n = data.depth_mm.size();
  const std::vector<Eigen::Index> at = VerticesOf(scene);
  const Eigen::MatrixXd contrasts =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(Eigen::MatrixXd::Identity(n, n) -
                                                     Eigen::MatrixXd::Constant(n, n, 1.0 / n))
          .eigenvectors()
          .rightCols(n - 1);
  const auto dense = [&](double length_mm, double signal_mm, double nugget_mm) {
    Eigen::MatrixXd v = signal_mm * signal_mm *
                        DenseCorrelations(scene.skull, GetParam(), length_mm)(at, at).array();
    v.diagonal() += (data.nugget_mm2.array() + nugget_mm * nugget_mm).matrix();
    const Eigen::MatrixXd of = contrasts.transpose() * v * contrasts;
    const Eigen::VectorXd y = contrasts.transpose() * data.depth_mm;
    return std::log(of.determinant()) + y.dot(of.inverse() * y);
  };
  const auto cost = [&](double length_mm, double signal_mm, double nugget_mm) {
    const Vec3 logs(std::log(length_mm), std::log(signal_mm), std::log(nugget_mm));
    return SurfaceMaternCost(options, data, correlations, logs, nullptr);
  };
  const double constant = cost(60, 1, 0.3) - dense(60, 1, 0.3);
  for (const double length_mm : {12.0, 30.0, 200.0}) {
    for (const double nugget_mm : {0.2, 1.0}) {
      EXPECT_NEAR(cost(length_mm, 2, nugget_mm), dense(length_mm, 2, nugget_mm) + constant, 2e-3);
    }
  }
}

TEST_P(EveryAlpha, GradientOfTheCostEqualsItsNumericTwin) {
  const DowelScene scene = SmallScene();
  const SurfaceMatern options{.alpha = GetParam(), .fit_nugget = true};
  const ReducedMatern correlations = CorrelationsOf(scene, options);
  const SurfaceMaternData data = SurfaceData(scene);
  const Eigen::VectorXd logs = Vec3(std::log(35.0), std::log(1.3), std::log(0.4));
  Eigen::VectorXd exact;
  SurfaceMaternCost(options, data, correlations, logs, &exact);
  constexpr double kStep = 1e-4;
  for (int k = 0; k < 3; ++k) {
    const Eigen::VectorXd step = kStep * Vec3::Unit(k);
    const double numeric = (SurfaceMaternCost(options, data, correlations, logs + step, nullptr) -
                            SurfaceMaternCost(options, data, correlations, logs - step, nullptr)) /
                           (2 * kStep);
    EXPECT_NEAR(exact[k], numeric, 1e-5 * (1 + std::abs(numeric)));
  }
}

TEST_P(EveryAlpha, FitIsNoWorseThanAnyPointOfAGrid) {
  const DowelScene scene = SmallScene();
  const SurfaceMatern options{.alpha = GetParam(), .fit_nugget = true};
  const ReducedMatern correlations = CorrelationsOf(scene, options);
  const SurfaceMaternData data = SurfaceData(scene);
  const SurfaceMaternHyper best = FitHyper(options, data, correlations, {});
  const auto cost = [&](double length_mm, double signal_mm, double nugget_mm) {
    const Vec3 logs(std::log(length_mm), std::log(signal_mm), std::log(nugget_mm));
    return SurfaceMaternCost(options, data, correlations, logs, nullptr);
  };
  const double least = cost(best.length_mm, best.signal_mm, best.nugget_mm);
  for (double length_mm = 8; length_mm < 600; length_mm *= 1.3) {
    for (double signal_mm = 0.2; signal_mm < 8; signal_mm *= 1.3) {
      for (const double nugget_mm : {0.02, 0.1, 0.5}) {
        EXPECT_GE(cost(length_mm, signal_mm, nugget_mm), least - 1e-6)
            << length_mm << " " << signal_mm << " " << nugget_mm;
      }
    }
  }
}

// As in kriging, a long length needs a signal of many times the depths' spread.
TEST_P(EveryAlpha, FitOfALongLengthIsNoWorseThanAnySignal) {
  const DowelScene scene = SmallScene();
  SurfaceMaternData data = SurfaceData(scene);
  data.nugget_mm2.setZero();
  const SurfaceMatern options{.alpha = GetParam(), .length_mm = 5000};
  const ReducedMatern correlations = CorrelationsOf(scene, options);
  const SurfaceMaternHyper best = FitHyper(options, data, correlations, {});
  EXPECT_TRUE(best.at_end.empty());
  const auto cost = [&](double signal_mm) {
    const Vec3 logs(std::log(5000.0), std::log(signal_mm), 0);
    return SurfaceMaternCost(options, data, correlations, logs, nullptr);
  };
  for (double signal_mm = 0.1; signal_mm < 1e5; signal_mm *= 1.1) {
    EXPECT_GE(cost(signal_mm), cost(best.signal_mm) - 1e-6) << signal_mm;
  }
}

TEST(GaussianRegression, OfTwoRegressorsIsGeneralisedLeastSquares) {
  Eigen::MatrixXd v(4, 4), f(4, 2);
  v << 2, 1, 0.5, 0, 1, 2, 1, 0.5, 0.5, 1, 2, 1, 0, 0.5, 1, 2;
  f << 1, 0, 1, 1, 1, 2, 1, 4;
  const Eigen::Vector4d y(1, 3, 2, 6);
  const GaussianRegression regression(v, 2, y, f);
  const Eigen::MatrixXd w = v.inverse();
  const Eigen::VectorXd b = (f.transpose() * w * f).inverse() * f.transpose() * w * y;
  EXPECT_NEAR((regression.coefficients() - b).norm(), 0, 1e-8);
  EXPECT_NEAR((regression.weights() - w * (y - f * b)).norm(), 0, 1e-8);
  EXPECT_NEAR(regression.Deviance(),
              std::log(v.determinant()) + std::log((f.transpose() * w * f).determinant()) +
                  (y - f * b).dot(w * (y - f * b)),
              1e-8);
}

TEST(SurfaceMatern, OnAPieceWithoutADowelIsTheMeanWithTheFullSd) {
  DowelScene scene = SmallScene();
  scene.skull = Joined(scene.skull, SphereMesh({0, 0, 64}, 2, 6));  // near, but loose
  scene.normals = VertexNormals(scene.skull);
  const SurfaceMatern options{
      .length_mm = 40, .signal_mm = 1.5, .clamp = false, .max_angle_deg = 180};
  const DepthField field = InterpolateDepth(options, scene.Input(), RunContext{});
  EXPECT_NEAR(field.depth_mm.back(), field.process->mean_mm, 1e-9);
  EXPECT_GT(field.sd_mm.back(), 1.5);
  EXPECT_LT(field.sd_mm.back(), 2);
}

TEST(SurfaceMatern, StatesNoSdIfTheDowelsDetermineOnlyTheMean) {
  const auto states = [](const SurfaceMatern& options, std::size_t dowels) {
    DowelScene scene = SmallScene();
    scene.dowels.resize(dowels);
    return std::ranges::any_of(InterpolateDepth(options, scene.Input(), {}).sd_mm,
                               [](double sd) { return std::isfinite(sd); });
  };
  EXPECT_FALSE(states({}, 1));
  EXPECT_TRUE(states({.signal_mm = 2}, 1));
  EXPECT_TRUE(states({}, 2));
  EXPECT_FALSE(states({.mean = DepthMean::kCovariates}, 3));
  EXPECT_TRUE(states({.mean = DepthMean::kCovariates}, 4));
}

TEST(SurfaceMatern, ACoarserMeshChangesLittle) {
  DowelScene scene = ScatteredScene(20);
  const SurfaceMatern own{.length_mm = 60, .signal_mm = 2, .edge_mm = 0};
  SurfaceMatern coarse = own;
  coarse.edge_mm = 5;
  scene.skull = SphereMesh({0, 0, 0}, 90, 60);
  scene.normals = VertexNormals(scene.skull);
  const DepthField a = InterpolateDepth(own, scene.Input(), RunContext{});
  const DepthField b = InterpolateDepth(coarse, scene.Input(), RunContext{});
  EXPECT_EQ(a.status, b.status);
  double squares = 0, of_sd = 0;
  for (std::size_t i = 0; i < a.status.size(); ++i) {
    if (a.status[i] == DepthStatus::kAssigned) {
      squares += std::pow(a.depth_mm[i] - b.depth_mm[i], 2);
      of_sd += std::pow(a.sd_mm[i] - b.sd_mm[i], 2);
    }
  }
  const int count = Count(a, DepthStatus::kAssigned);
  EXPECT_LT(std::sqrt(squares / count), 0.1);
  EXPECT_LT(std::sqrt(of_sd / count), 0.1);
}

TEST(SurfaceMatern, AFittedNuggetSmoothsNoiseAndNotASlope) {
  DowelScene noisy = ScatteredScene(40), smooth = noisy;
  for (std::size_t k = 0; k < noisy.dowels.size(); ++k) {
    smooth.dowels[k].depth_mm = 10 + smooth.dowels[k].base.z() / 20;
    noisy.dowels[k].depth_mm = smooth.dowels[k].depth_mm + (k % 2 == 0 ? 1.5 : -1.5);
  }
  const SurfaceMatern options{.fit_nugget = true};
  EXPECT_GT(InterpolateDepth(options, noisy.Input(), {}).process->nugget_mm, 1);
  EXPECT_LT(InterpolateDepth(options, smooth.Input(), {}).process->nugget_mm, 0.2);
}

TEST(SurfaceMatern, NeedsASurface) {
  const DowelScene scene = SmallScene().At({{0, 0, 60}});
  EXPECT_THROW(InterpolateDepth(SurfaceMatern{}, scene.Input(), RunContext{}), InputError);
  EXPECT_TRUE(NeedsSurface(SurfaceMatern{}));
}

// Every scheme with a mean.
class EveryMean : public ::testing::TestWithParam<DepthScheme> {};
INSTANTIATE_TEST_SUITE_P(
    DepthMean, EveryMean,
    ::testing::Values(DepthScheme(Kriging{.clamp = false, .max_angle_deg = 180}),
                      DepthScheme(SurfaceMatern{.clamp = false, .max_angle_deg = 180})));

DepthScheme With(DepthScheme scheme, DepthMean mean) {
  std::visit(
      [&](auto& options) {
        if constexpr (requires { options.mean = mean; }) {
          options.mean = mean;
        }
      },
      scheme);
  return scheme;
}

TEST_P(EveryMean, ASubjectThatIsTheTableTimesAFactorIsThatEverywhere) {
  DowelScene scene = ScatteredScene(12);
  std::vector<Dowel> expected = scene.dowels;
  const DepthField of_table =
      InterpolateDepth(Kriging{.max_angle_deg = 180},
                       {scene.skull, scene.normals, expected, scene.network}, RunContext{});
  scene.dowels.resize(5);
  for (Dowel& dowel : scene.dowels) {
    dowel.depth_mm *= 1.3;
  }
  DepthInput input{scene.skull, scene.normals, scene.dowels, scene.network, expected};
  const DepthScheme table = With(GetParam(), DepthMean::kTable);
  EXPECT_TRUE(NeedsExpected(table));
  const DepthField field = InterpolateDepth(table, input, RunContext{});
  for (std::size_t i = 0; i < field.status.size(); ++i) {
    ASSERT_NEAR(field.depth_mm[i], 1.3 * of_table.depth_mm[i], 1e-4);
  }
  input.expected = {};
  try {
    InterpolateDepth(table, input, RunContext{});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("needs the mean depths of a table"));
  }
}

// A wavy plate with edges longer than edge_mm, so that the coarse surface keeps them.
TriMesh RoughPlate() {
  TriMesh plate = Plate(160, 40);
  for (Vec3& p : plate.points) {
    p.z() = 6 * std::sin(p.x() / 15) * std::cos(p.y() / 25);
  }
  return plate;
}

TEST_P(EveryMean, DepthsThatAreTheReliefTimesAFactorAreThatEverywhere) {
  DowelScene scene = ScatteredScene(12);
  scene.skull = RoughPlate();
  scene.normals = VertexNormals(scene.skull);
  const Eigen::MatrixXd relief = BoneRelief(scene.skull, std::vector<double>{10.0, 40.0});
  const auto depth_at = [&](std::size_t v) {
    const auto column = static_cast<Eigen::Index>(v);
    return 20 + 1.5 * relief(0, column) - 0.5 * relief(1, column);
  };
  for (std::size_t k = 0; k < scene.dowels.size(); ++k) {
    const std::size_t v = 130 * (k + 1);
    scene.dowels[k].base = scene.skull.points[v];
    scene.dowels[k].depth_mm = depth_at(v);
  }
  const DepthScheme covariates = With(GetParam(), DepthMean::kCovariates);
  EXPECT_TRUE(NeedsSurface(covariates));
  const DepthField field = InterpolateDepth(covariates, scene.Input(), RunContext{});
  for (std::size_t i = 0; i < field.status.size(); ++i) {
    ASSERT_NEAR(field.depth_mm[i], depth_at(i), 1e-4);
  }
  scene.dowels.resize(2);
  EXPECT_THROW(InterpolateDepth(covariates, scene.Input(), RunContext{}), InputError);
}

TEST_P(EveryMean, DepthsThatFollowThePlaceInTheHeadDoSoEverywhere) {
  DowelScene scene = ScatteredScene(14);
  scene.skull = RoughPlate();
  scene.normals = VertexNormals(scene.skull);
  const std::vector<std::string> sites = {"mso_l", "mio_l", "mso_r", "mio_r", "zy_l", "zy_r"};
  for (std::size_t k = 0; k < scene.dowels.size(); ++k) {
    scene.dowels[k].site = k < sites.size() ? sites[k] : "d" + std::to_string(k);
    scene.dowels[k].base = scene.skull.points[113 * (k + 1)];
  }
  const Eigen::MatrixXd geometry = BoneGeometry(scene.skull, FindHeadFrame(scene.dowels));
  const auto depth_at = [&](std::size_t v) {
    return 20 +
           Eigen::RowVector4d(0.3, 2, -1, 0.02).dot(geometry.col(static_cast<Eigen::Index>(v)));
  };
  for (std::size_t k = 0; k < scene.dowels.size(); ++k) {
    scene.dowels[k].depth_mm = depth_at(113 * (k + 1));
  }
  const DepthScheme scheme = With(GetParam(), DepthMean::kGeometry);
  EXPECT_TRUE(NeedsSurface(scheme));
  const DepthField field = InterpolateDepth(scheme, scene.Input(), RunContext{});
  for (std::size_t i = 0; i < field.status.size(); ++i) {
    ASSERT_NEAR(field.depth_mm[i], depth_at(i), 1e-3);
  }
  scene.dowels.resize(6);
  EXPECT_THROW(InterpolateDepth(scheme, scene.Input(), RunContext{}), InputError);
}

}  // namespace
}  // namespace semblance::interp
