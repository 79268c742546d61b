// SPDX-License-Identifier: GPL-3.0-or-later
// The cotangent Laplacian, its solver, and the harmonic and biharmonic schemes on it.
#include "interp/on_surface/mesh_spline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "interp/on_surface/mesh_laplacian.h"
#include "interp/on_surface/mesh_solver.h"
#include "interp/schemes/harmonic.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/mesh/mesh_primitives.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::Count;
using testing::DowelScene;
using testing::FlatScene;
using testing::Plate;
using testing::ScatteredScene;
using testing::SphereMesh;

Eigen::VectorXd Values(const TriMesh& mesh, const std::function<double(const Vec3&)>& at) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(mesh.points.size()));
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    values[i] = at(mesh.points[i]);
  }
  return values;
}

TEST(MeshLaplacian, GivesTheDirichletEnergyOfALinearFunctionAndTheArea) {
  const TriMesh plate = Plate(40, 20);
  const MeshLaplacian laplacian = BuildLaplacian(plate);
  const Eigen::VectorXd u = Values(plate, [](const Vec3& p) { return 2 * p.x() + p.y(); });
  EXPECT_NEAR(u.dot(laplacian.stiffness * u), 5 * 1600, 10);  // except for the minimum edge weights
  EXPECT_NEAR(laplacian.area_mm2.sum(), 1600, 1e-9);
  EXPECT_NEAR((laplacian.stiffness * Eigen::VectorXd::Ones(u.size())).norm(), 0, 1e-12);
}

TEST(MeshLaplacian, OfASphereHasTheHeightAsAnEigenfunction) {  // eigenvalue 2 / R^2
  const TriMesh sphere = SphereMesh({0, 0, 0}, 10, 40);
  const MeshLaplacian laplacian = BuildLaplacian(sphere);
  const Eigen::VectorXd z = Values(sphere, [](const Vec3& p) { return p.z(); });
  const double quotient =
      z.dot(laplacian.stiffness * z) / z.dot(laplacian.area_mm2.cwiseProduct(z));
  EXPECT_NEAR(quotient, 0.02, 2e-4);
}

TEST(MeshLaplacian, StaysFiniteAndNegativeOffTheDiagonalOnSliversAndDegenerateTriangles) {
  TriMesh mesh = Plate(10, 4);
  mesh.points[7] = mesh.points[8];                          // triangles without area
  mesh.points[12] = mesh.points[11] + Vec3(1e-9, 1e-9, 0);  // slivers
  mesh.triangles.push_back({3, 3, 9});
  mesh.points.emplace_back(50, 50, 50);  // of no triangle
  const MeshLaplacian laplacian = BuildLaplacian(mesh);
  for (int c = 0; c < laplacian.stiffness.outerSize(); ++c) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(laplacian.stiffness, c); it; ++it) {
      ASSERT_TRUE(std::isfinite(it.value()));
      ASSERT_TRUE(it.row() == it.col() ? it.value() >= 0 : it.value() < 0);
    }
  }
  EXPECT_GT(laplacian.area_mm2.minCoeff(), 0);
}

TEST(LabelPieces, AreThoseOfTheTriangles) {
  TriMesh mesh = Plate(10, 2);
  Append(mesh, Plate(10, 1));
  mesh.points.emplace_back(0, 0, 9);
  EXPECT_THAT(LabelPieces(BuildLaplacian(mesh).stiffness),
              ::testing::ElementsAre(0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2));
}

TEST(MeshSolver, Solves) {
  const TriMesh sphere = SphereMesh({5, 0, 0}, 10, 30);
  const MeshLaplacian laplacian = BuildLaplacian(sphere);
  Eigen::SparseMatrix<double> matrix = laplacian.stiffness;
  matrix.diagonal() += laplacian.area_mm2;
  Random random(3);
  Eigen::MatrixXd right(static_cast<Eigen::Index>(sphere.points.size()), 3);
  for (double& value : right.reshaped()) {
    value = random.Uniform(-1, 1);
  }
  const Eigen::MatrixXd solution = MeshSolver(sphere.points, matrix).Solve(right);
  EXPECT_NEAR((matrix * solution - right).norm(), 0, 1e-11);
}

// The plate with dowels at x = 0 and x = 40, all along y.
DowelScene Strip(double depth_left, double depth_right) {
  DowelScene scene = FlatScene();
  scene.network.areas.clear();
  scene.dowels.clear();
  for (std::size_t i = 0; i < scene.skull.points.size(); ++i) {
    const Vec3& p = scene.skull.points[i];
    if (p.x() == 0 || p.x() == 40) {
      scene.dowels.push_back(
          {std::to_string(1000 + i), p, {0, 0, 1}, p.x() == 0 ? depth_left : depth_right, kNaN});
    }
  }
  return scene;
}

TEST(Harmonic, IsLinearBetweenTwoEdges) {
  const DowelScene scene = Strip(4, 9);
  const DepthField field = InterpolateDepth(Harmonic{.radius_mm = 0}, scene.Input(), RunContext{});
  for (std::size_t i = 0; i < field.depth_mm.size(); ++i) {
    ASSERT_NEAR(field.depth_mm[i], 4 + scene.skull.points[i].x() / 8, 3e-4);
  }
}

TEST(Harmonic, MeetsTheDowelsInTheMeanOverTheirRadius) {
  const DowelScene scene = ScatteredScene(7);
  const Harmonic harmonic{.radius_mm = 15, .max_angle_deg = 180};
  const DepthField field = InterpolateDepth(harmonic, scene.Input(), RunContext{});
  const Eigen::VectorXd area = BuildLaplacian(scene.skull).area_mm2;
  for (const Dowel& dowel : scene.dowels) {
    double sum = 0, weight = 0;
    for (std::size_t i = 0; i < field.depth_mm.size(); ++i) {
      const bool near = (scene.skull.points[i] - dowel.base).norm() <= 15;
      sum += near ? area[i] * field.depth_mm[i] : 0;
      weight += near ? area[i] : 0;
    }
    EXPECT_NEAR(sum / weight, dowel.depth_mm, 0.2);  // the clamp cuts off some
  }
}

TEST(Harmonic, AtRadiusZeroMeetsTheDowels) {
  const DowelScene scene = ScatteredScene(7);
  const DepthField field = InterpolateDepth(Harmonic{.radius_mm = 0}, scene.Input(), RunContext{});
  for (const Dowel& dowel : scene.dowels) {
    const auto at = std::ranges::find(scene.skull.points, dowel.base) - scene.skull.points.begin();
    EXPECT_NEAR(field.depth_mm[at], dowel.depth_mm, 1e-6);
  }
}

TEST(Biharmonic, ReproducesTheBendOfABeam) {
  // Free borders: along x, u'''' = 0 between supports, and u' = 0 at both ends (the only slope at
  // open borders of a mesh's Laplacian).
  DowelScene scene = Strip(4, 9);
  const DepthField field = InterpolateDepth(Biharmonic{}, scene.Input(), RunContext{});
  for (std::size_t i = 0; i < field.depth_mm.size(); ++i) {
    const double t = scene.skull.points[i].x() / 40;
    ASSERT_NEAR(field.depth_mm[i], 4 + 5 * t * t * (3 - 2 * t), 0.02);
  }
}

TEST(Biharmonic, IsSmootherAtADowelThanHarmonic) {
  DowelScene scene = ScatteredScene(9);
  const auto at =
      std::ranges::find(scene.skull.points, scene.dowels[4].base) - scene.skull.points.begin();
  std::set<int> ring;
  for (const Triangle& t : scene.skull.triangles) {
    if (std::ranges::find(t, static_cast<int>(at)) != t.end()) {
      ring.insert(t.begin(), t.end());
    }
  }
  const auto spike = [&](const DepthField& field) {  // relative to the mean of its ring
    double sum = 0;
    for (const int i : ring) {
      sum += field.depth_mm[i] - field.depth_mm[at];
    }
    return std::abs(sum / static_cast<double>(ring.size()));
  };
  const double harmonic =
      spike(InterpolateDepth(Harmonic{.radius_mm = 0}, scene.Input(), RunContext{}));
  EXPECT_LT(spike(InterpolateDepth(Biharmonic{}, scene.Input(), RunContext{})), 0.3 * harmonic);
}

TEST(MeshSplines, GoAlongTheBoneAndLeavePiecesWithoutADowel) {
  // A second plate 1 mm below the first, another with a dowel of its own far away.
  DowelScene scene = FlatScene();
  const int n = static_cast<int>(scene.skull.points.size());
  const TriMesh one = scene.skull;
  for (const Vec3& shift : {Vec3(0, 0, -1), Vec3(100, 0, 0)}) {
    const int first = static_cast<int>(scene.skull.points.size());
    for (const Vec3& p : one.points) {
      scene.skull.points.push_back(p + shift);
      scene.normals.emplace_back(0, 0, 1);
    }
    for (const Triangle& t : one.triangles) {
      scene.skull.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
  }
  scene.dowels.push_back({"me", {120, 20, 0}, {0, 0, 1}, 12, kNaN});
  for (const DepthField& field : {InterpolateDepth(Harmonic{}, scene.Input(), RunContext{}),
                                  InterpolateDepth(Biharmonic{}, scene.Input(), RunContext{})}) {
    EXPECT_EQ(Count(field, DepthStatus::kAssigned), 2 * n);
    for (int i = 0; i < n; ++i) {
      ASSERT_LE(field.depth_mm[i], 9.5);
      ASSERT_EQ(field.status[n + i], DepthStatus::kOutside);
      ASSERT_TRUE(std::isnan(field.depth_mm[n + i]));
      ASSERT_NEAR(field.depth_mm[2 * n + i], 12, 1e-9);
    }
  }
}

TEST(MeshSplines, SoftnessLeadsToTheMean) {
  const DowelScene scene = FlatScene();
  for (const DepthField& field :
       {InterpolateDepth(Harmonic{.softness = 1e6}, scene.Input(), RunContext{}),
        InterpolateDepth(Biharmonic{.softness = 1e6}, scene.Input(), RunContext{})}) {
    EXPECT_THAT(field.depth_mm, ::testing::Each(::testing::DoubleNear(6.25, 1e-4)));
  }
}

TEST(MeshSplines, IgnoreARepeatedDowel) {  // 64 and 65 dowels use different methods
  DowelScene scene = FlatScene();
  Random random(5);
  scene.dowels.clear();
  for (std::size_t k = 0; k < 64; ++k) {
    const Vec3& base = scene.skull.points[k * scene.skull.points.size() / 64];
    scene.dowels.push_back({"g", base, Vec3::UnitZ(), random.Uniform(4, 7), kNaN});
  }
  DowelScene twice = scene;
  twice.dowels.push_back(scene.dowels[17]);
  twice.dowels.back().base.z() += 1e-3;  // in one place, dowels would be merged; here they are not
  const DepthField once = InterpolateDepth(Biharmonic{}, scene.Input(), RunContext{}),
                   again = InterpolateDepth(Biharmonic{}, twice.Input(), RunContext{});
  for (std::size_t i = 0; i < once.depth_mm.size(); ++i) {
    ASSERT_NEAR(once.depth_mm[i], again.depth_mm[i], 1e-6);
  }
}

// One factorisation for all folds gives the result of a solve without the fold's dowels.
TEST(MeshSplines, LeftOutAreAsIfTheDowelHadNotBeenThere) {
  for (const int count : {12, 66}) {  // more than 64 use another method
    const DowelScene scene = ScatteredScene(count);
    const Folds folds = {{3}, {0, 7}};
    const auto check = [&](const auto& scheme) {
      const auto fields = InterpolateLeftOut(scheme, scene.Input(), folds, RunContext{});
      ASSERT_EQ(fields.size(), folds.size());
      for (std::size_t f = 0; f < folds.size(); ++f) {
        const ShownDowels shown = LeaveOutDowels(scene.dowels, scene.network, folds[f]);
        const DepthField whole = InterpolateDepth(
            scheme, {scene.skull, scene.normals, shown.dowels, shown.network}, RunContext{});
        for (std::size_t k = 0; k < folds[f].size(); ++k) {
          const auto at = std::ranges::find(scene.skull.points, scene.dowels[folds[f][k]].base) -
                          scene.skull.points.begin();
          EXPECT_NEAR(fields[f].depth_mm[k], whole.depth_mm[at], 1e-8);
        }
      }
    };
    check(Biharmonic{.clamp = false});
    check(Harmonic{.radius_mm = 0});
    check(Harmonic{.radius_mm = 0, .softness = 0.1});
  }
}

TEST(MeshSplines, ReportThatTheyNeedTriangles) {
  const DowelScene scene = FlatScene().At({{1, 2, 3}});
  try {
    InterpolateDepth(Biharmonic{}, scene.Input(), RunContext{});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(),
                 "biharmonic: the skull has 1 vertices and no triangle, but this scheme works "
                 "along its surface; give a mesh or choose a scheme in space");
  }
}

}  // namespace
}  // namespace semblance::interp
