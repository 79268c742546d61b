// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/implicit_surface.h"

#include <gtest/gtest.h>

#include <numbers>
#include <numeric>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using testing::Plate;
using testing::SphereMesh;

ImplicitSurface Surface(const TriMesh& mesh, double depth_mm, const Emitter& emitter,
                        double tail_error = 0) {
  return ImplicitSurface(mesh, std::vector<double>(mesh.points.size(), depth_mm),
                         {emitter, tail_error});
}

// The outermost zero of the value along `direction` from `inside`, within reach.
double CrossingHeight(const ImplicitSurface& surface, const Vec3& base, const Vec3& direction,
                      double reach_mm) {
  double low = 0, high = reach_mm;
  for (double h = 0; h < reach_mm; h += reach_mm / 200) {
    low = surface.Value(base + h * direction) > 0 ? h : low;
  }
  high = low + reach_mm / 200;
  for (int step = 0; step < 30; ++step) {
    const double middle = (low + high) / 2;
    (surface.Value(base + middle * direction) > 0 ? low : high) = middle;
  }
  return low;
}

// A plate of 280 mm of right triangles with the given leg. Larger tail errors save time.
double PlateHeight(double depth_mm, double edge_mm, const Emitter& emitter, double tail_error) {
  const ImplicitSurface surface =
      Surface(Plate(280, static_cast<int>(280 / edge_mm)), depth_mm, emitter, tail_error);
  const Vec3 middle(140 + 0.3 * edge_mm, 140 + 0.2 * edge_mm, 0);
  return CrossingHeight(surface, middle, Vec3::UnitZ(), 10 * depth_mm);
}

TEST(FlatEmitter, APlateHasExactlyItsDepthWhateverItsMesh) {
  for (const double depth : {5.0, 10.0, 20.0}) {
    for (const double edge : {1.0, 2.0, 4.0, 8.0}) {
      EXPECT_NEAR(PlateHeight(depth, edge, FlatEmitter{}, 1e-3) / depth, 1, 0.02)
          << depth << " " << edge;
    }
  }
}

// Height of the surface over a plate, by brute force over exact distances.
struct PlateCase {
  double depth_mm, edge_mm, k6_t0, k6_t05, k15_t0, k15_t05;
};
class PlateTable : public ::testing::TestWithParam<PlateCase> {};

TEST_P(PlateTable, ThesisAndSplitEmittersAsComputedIndependently) {
  const PlateCase& c = GetParam();
  EXPECT_NEAR(PlateHeight(c.depth_mm, c.edge_mm, ThesisEmitter{6}, 0) / c.k6_t0, 1, 0.02);
  EXPECT_NEAR(PlateHeight(c.depth_mm, c.edge_mm, SplitEmitter{6, 0.5}, 0) / c.k6_t05, 1, 0.02);
  EXPECT_NEAR(PlateHeight(c.depth_mm, c.edge_mm, ThesisEmitter{15}, 0) / c.k15_t0, 1, 0.02);
  EXPECT_NEAR(PlateHeight(c.depth_mm, c.edge_mm, SplitEmitter{15, 0.5}, 0) / c.k15_t05, 1, 0.02);
}
INSTANTIATE_TEST_SUITE_P(BCalc, PlateTable,
                         ::testing::Values(PlateCase{5, 4, 8.5, 5.9, 5.6, 5.1},
                                           PlateCase{10, 2, 30.4, 16.1, 13.1, 11.0},
                                           PlateCase{10, 4, 22.2, 13.5, 12.1, 10.6},
                                           PlateCase{10, 8, 16.9, 11.8, 11.2, 10.3},
                                           PlateCase{20, 8, 44.4, 26.9, 24.1, 21.2}));

class EmitterLaws : public ::testing::TestWithParam<Emitter> {};
INSTANTIATE_TEST_SUITE_P(All, EmitterLaws,
                         ::testing::Values(Emitter(FlatEmitter{}), Emitter(FlatEmitter{4.5}),
                                           Emitter(FlatEmitter{6, EmitterDepth::kLinear}),
                                           Emitter(SplitEmitter{}), Emitter(ThesisEmitter{})));

TEST_P(EmitterLaws, NothingIsInfiniteOrNaN) {
  const TriMesh plate = Plate(30, 3);
  const ImplicitSurface surface = Surface(plate, 5, GetParam());
  for (const Vec3& p : plate.points) {
    for (const double h : {0.0, 1e-14, 1e-6, -1e-6, 1.0}) {
      EXPECT_TRUE(std::isfinite(surface.Value(p + Vec3(0, 0, h))));
      EXPECT_TRUE(std::isfinite(surface.Value(p + Vec3(1.7, 0, h))));
    }
  }
  EXPECT_EQ(surface.Value({15, 15, -1}), -1);  // nothing behind
}

TEST_P(EmitterLaws, MovesWithTheSkull) {
  const TriMesh sphere = SphereMesh({0, 0, 0}, 40, 12);
  const Similarity move{1, Eigen::AngleAxisd(0.8, Vec3(1, 2, 2).normalized()).toRotationMatrix(),
                        Vec3(5, -7, 11)};
  const ImplicitSurface before = Surface(sphere, 8, GetParam()),
                        after = Surface(Transformed(sphere, move), 8, GetParam());
  Random random(3);
  for (int n = 0; n < 30; ++n) {
    const Vec3 p = 50 * random.InBox(-1, 1).normalized();
    EXPECT_NEAR(before.Value(p), after.Value(move * p), 1e-9 * (1 + std::abs(before.Value(p))));
  }
}

TEST_P(EmitterLaws, ScalesWithTheSkullAndItsDepth) {
  const TriMesh sphere = SphereMesh({0, 0, 0}, 40, 12);
  const Similarity fourfold{4, Mat3::Identity(), Vec3::Zero()};  // a power of 2 causes no round-off
  const ImplicitSurface small = Surface(sphere, 8, GetParam()),
                        large = Surface(Transformed(sphere, fourfold), 32, GetParam());
  Random random(4);
  for (int n = 0; n < 30; ++n) {
    const Vec3 p = random.Uniform(42, 70) * random.InBox(-1, 1).normalized();
    EXPECT_NEAR(small.Value(p), large.Value(4 * p), 1e-9 * (1 + std::abs(small.Value(p))));
  }
}

TEST_P(EmitterLaws, MoreDepthNeverEmitsLess) {
  const TriMesh sphere = SphereMesh({0, 0, 0}, 40, 12);
  const ImplicitSurface thin = Surface(sphere, 6, GetParam()),
                        thick = Surface(sphere, 9, GetParam());
  Random random(5);
  for (int n = 0; n < 50; ++n) {
    const Vec3 p = random.Uniform(50, 70) * random.InBox(-1, 1).normalized();
    EXPECT_GE(thick.Value(p), thin.Value(p));
  }
}

TEST_P(EmitterLaws, TheFarFieldIsWithinItsBound) {
  const TriMesh sphere = SphereMesh({0, 0, 0}, 90, 30);
  for (const double error : {1e-2, 1e-3}) {
    const ImplicitSurface all = Surface(sphere, 6, GetParam(), 0),
                          cut = Surface(sphere, 6, GetParam(), error);
    Random random(6);
    for (int n = 0; n < 40; ++n) {
      const Vec3 p = random.Uniform(94, 110) * random.InBox(-1, 1).normalized();
      EXPECT_NEAR(cut.Value(p), all.Value(p), error);
    }
  }
}

// The emission of a triangle by 4^7 parts, each by its centroid. Depths of its corners.
double EmissionByParts(const TriMesh& t, const Vec3& depth_mm, double decay, const Vec3& p) {
  const int parts = 128;
  const Vec3 ab = t.points[1] - t.points[0], ac = t.points[2] - t.points[0];
  double sum = 0;
  for (int i = 0; i < parts; ++i) {
    for (int j = 0; i + j < parts; ++j) {
      for (const double third : {1.0 / 3, 2.0 / 3}) {
        if (third < 0.5 || i + j + 1 < parts) {
          const double u = (i + third) / parts, v = (j + third) / parts;
          sum += std::pow(depth_mm.dot(Vec3(1 - u - v, u, v)), decay) *
                 std::pow((p - t.points[0] - u * ab - v * ac).norm(), -(decay + 3));
        }
      }
    }
  }
  return (decay + 1) / (2 * std::numbers::pi) * p.z() * sum * 0.5 * ab.cross(ac).norm() /
         (parts * parts);
}

// Far, near, beside and over the triangle, which lies in the plane z = 0.
void ExpectEmissionByParts(const FlatEmitter& emitter, const Vec3& depth_mm, double within) {
  const TriMesh triangle{{{0, 0, 0}, {4, 0, 0}, {1, 3, 0}}, {{0, 1, 2}}};
  const ImplicitSurface surface(
      triangle, std::vector<double>{depth_mm[0], depth_mm[1], depth_mm[2]}, {emitter, 0});
  std::vector<std::int32_t> all(surface.EmitterCount());
  std::iota(all.begin(), all.end(), 0);
  Random random(8);
  for (int n = 0; n < 60; ++n) {
    const double reach = n % 2 == 0 ? 3 : 20;
    const Vec3 p(random.Uniform(-reach, reach), random.Uniform(-reach, reach),
                 random.Uniform(0.4, reach));
    const double emission = EmissionByParts(triangle, depth_mm, emitter.decay, p);
    EXPECT_NEAR((surface.Value(p) + 1) / emission, 1, within)
        << emitter.decay << ": " << p.transpose();
    EXPECT_NEAR(surface.SumEmissions(all, p) / emission, 1, within) << p.transpose();
  }
}

TEST(FlatEmitter, ATriangleAloneIsItsIntegral) {
  for (const double decay : {6.0, 5.0, 4.5}) {
    ExpectEmissionByParts({decay}, Vec3(7, 7, 7), decay == 4.5 ? 0.03 : 0.012);
  }
}

// The integral over the triangle in the plane z = 0 of |p - q|^-(k+3), in polar coordinates around
// the foot of p. Along the radius it is elementary: 1 / (k+1) times the difference of |p -
// q|^-(k+1) between both ends. Around the foot each edge is summed by the midpoint rule. The angles
// add up to 2 pi if the foot lies inside the triangle, else to 0.
double IntegralAroundFoot(const TriMesh& t, double decay, const Vec3& p) {
  const int parts = 4000;
  double sum = 0, angle = 0;
  for (int e = 0; e < 3; ++e) {
    const Vec3 &a = t.points[e], &b = t.points[(e + 1) % 3];
    for (int k = 0; k < parts; ++k) {
      const double from = static_cast<double>(k) / parts, to = (k + 1.0) / parts;
      const Vec3 first = a + from * (b - a) - p, last = a + to * (b - a) - p;
      const double turn = std::atan2(first.x() * last.y() - first.y() * last.x(),
                                     first.x() * last.x() + first.y() * last.y());
      sum -= turn * std::pow((0.5 * (first + last)).norm(), -(decay + 1));
      angle += turn;
    }
  }
  const bool inside = angle > 1;
  return (sum + (inside ? 2 * std::numbers::pi * std::pow(p.z(), -(decay + 1)) : 0)) / (decay + 1);
}

// Low over and beside a triangle that is large against the depth and the height, where the closed
// form of high decays loses all digits.
TEST(FlatEmitter, ALargeTriangleIsItsIntegralForHighDecaysToo) {
  const TriMesh triangle{{{0, 0, 0}, {60, 0, 0}, {15, 45, 0}}, {{0, 1, 2}}};
  const double depth_mm = 5;
  std::vector<std::int32_t> only = {0};
  for (const double decay : {6.0, 12.5, 15.0, 20.0, 30.0}) {
    const ImplicitSurface surface(triangle, std::vector<double>(3, depth_mm),
                                  {FlatEmitter{decay}, 0});
    Random random(9);
    for (int n = 0; n < 60; ++n) {
      const Vec3 p(random.Uniform(-15, 75), random.Uniform(-15, 60), random.Uniform(1, 8));
      const double emission =
          std::min(kMaxEmission, (decay + 1) / (2 * std::numbers::pi) * std::pow(depth_mm, decay) *
                                     p.z() * IntegralAroundFoot(triangle, decay, p));
      EXPECT_NEAR(surface.SumEmissions(only, p) / emission, 1, 0.012)
          << decay << ": " << p.transpose();
      if (emission > 1e-3) {
        EXPECT_NEAR((surface.Value(p) + 1) / emission, 1, 0.012) << decay << ": " << p.transpose();
      }
    }
  }
}

TEST(FlatEmitter, WithLinearDepthATriangleIsTheIntegralOfItsDepth) {
  for (const double decay : {6.0, 5.0, 4.5}) {
    for (const Vec3& depth : {Vec3(7.3, 7, 6.6), Vec3(4, 7, 9), Vec3(7, 7, 7)}) {
      ExpectEmissionByParts({decay, EmitterDepth::kLinear}, depth, decay == 4.5 ? 0.04 : 0.015);
    }
  }
}

// Over a plate whose depth rises with the slope 0.1; mean depths make a step at each triangle.
TEST(FlatEmitter, WithLinearDepthASlopeHasNoSteps) {
  const TriMesh plate = Plate(160, 20);
  std::vector<double> depth;
  for (const Vec3& p : plate.points) {
    depth.push_back(4 + 0.1 * p.x());
  }
  const auto roughness = [&](EmitterDepth over_triangle) {
    const ImplicitSurface surface(plate, depth, {FlatEmitter{6, over_triangle}, 1e-4});
    double most = 0;
    for (double x = 20; x < 36; x += 0.5) {
      const auto height = [&](double at) {
        return CrossingHeight(surface, {at, 80, 0}, Vec3::UnitZ(), 12);
      };
      most = std::max(most, std::abs(height(x) - 2 * height(x + 2) + height(x + 4)));
    }
    return most;
  };
  EXPECT_LT(roughness(EmitterDepth::kLinear), 0.5 * roughness(EmitterDepth::kMean));
}

TEST(ThesisEmitter, ATriangleAloneIsExtrusionCylindersAndBalls) {
  TriMesh triangle{{{0, 0, 0}, {30, 0, 0}, {0, 20, 0}}, {{0, 1, 2}}};
  const double depth = 7;
  const ImplicitSurface surface = Surface(triangle, depth, ThesisEmitter{});
  const MeshQuery query(triangle);
  Random random(8);
  for (int n = 0; n < 300; ++n) {
    const Vec3 p(random.Uniform(-10, 40), random.Uniform(-10, 30), random.Uniform(-10, 10));
    const double distance = query.Closest(p).distance_mm;
    if (std::abs(distance - depth) > 1e-6) {
      EXPECT_EQ(surface.Value(p) > 0, p.z() > 0 && distance < depth) << p.transpose();
    }
  }
}

// d = l m^(1/k) with m = 500 (thesis 3.2.2), for l = 10 mm around a triangle in the plane z = 0.
TEST(ThesisEmitter, TheBoxOfInfluenceReachesToWhere500EmittersWouldMakeASurface) {
  const TriMesh triangle{{{0, 0, 0}, {6, 0, 0}, {0, 3, 0}}, {{0, 1, 2}}};
  const std::vector<double> depth_mm(3, 10.0);
  const std::vector<std::int32_t> only = {0};
  for (const auto& [decay, reach_mm] :
       {std::pair{6.0, 28.172691}, std::pair{3.0, 79.370053}, std::pair{15.0, 15.133220}}) {
    const ImplicitSurface surface(triangle, depth_mm, {ThesisEmitter{decay}, 0});
    const Box3 box = surface.InfluenceBox(0, 500);
    EXPECT_NEAR((box.min() - Vec3(-reach_mm, -reach_mm, -reach_mm)).norm(), 0, 1e-5) << decay;
    EXPECT_NEAR((box.max() - Vec3(6 + reach_mm, 3 + reach_mm, reach_mm)).norm(), 0, 1e-5);
    EXPECT_NEAR(surface.SumEmissions(only, {1, 1, box.max().z()}), 1.0 / 500, 1e-9);
  }
}

// The same with the depth (1 - t) l around the triangle, where it was moved to, and its prism.
TEST(SplitEmitter, TheBoxOfInfluenceIsAroundTheMovedTriangleAndItsPrism) {
  const TriMesh triangle{{{0, 0, 0}, {6, 0, 0}, {0, 3, 0}}, {{0, 1, 2}}};
  const ImplicitSurface surface(triangle, std::vector<double>(3, 10.0),
                                {SplitEmitter{.decay = 6, .split = 0.3}, 0});
  const Box3 box = surface.InfluenceBox(0, 500);
  const double reach_mm = 0.7 * 28.172691;
  EXPECT_NEAR((box.min() - Vec3(-reach_mm, -reach_mm, -reach_mm)).norm(), 0, 1e-5);
  EXPECT_NEAR((box.max() - Vec3(6 + reach_mm, 3 + reach_mm, 3 + reach_mm)).norm(), 0, 1e-5);
  EXPECT_NEAR(surface.SumEmissions(std::vector<std::int32_t>{0}, {1, 1, box.max().z()}), 1.0 / 500,
              1e-9);
}

TEST(SplitEmitter, WithoutSplitItIsTheThesisEmitter) {
  const TriMesh sphere = SphereMesh({0, 0, 0}, 40, 10);
  const ImplicitSurface split = Surface(sphere, 8, SplitEmitter{6, 0}),
                        thesis = Surface(sphere, 8, ThesisEmitter{6});
  Random random(9);
  for (int n = 0; n < 40; ++n) {
    const Vec3 p = random.Uniform(42, 80) * random.InBox(-1, 1).normalized();
    EXPECT_NEAR(split.Value(p), thesis.Value(p), 1e-9 * (1 + std::abs(thesis.Value(p))));
  }
}

TEST(FlatEmitter, ASphereSkullIsNearItsDepthAtAnyDensity) {
  for (const int rings : {20, 40}) {
    const ImplicitSurface surface =
        Surface(SphereMesh({0, 0, 0}, 80, rings), 8, FlatEmitter{}, 1e-4);
    const double height =
        CrossingHeight(surface, 80 * Vec3(1, 2, 3).normalized(), Vec3(1, 2, 3).normalized(), 40);
    EXPECT_NEAR(height / 8, 1, 0.06) << rings;  // curvature: about -l/(4R) * 5/k
  }
}

TEST(ImplicitSurface, TrianglesWithoutDepthDoNotEmit) {
  const TriMesh plate = Plate(100, 10);
  std::vector<double> depth(plate.points.size(), 5);
  for (std::size_t v = 0; v < depth.size(); ++v) {
    depth[v] = plate.points[v].x() > 50 ? kNaN : 5;
  }
  const ImplicitSurface surface(plate, depth, {});
  EXPECT_EQ(surface.EmitterCount(), 100);
  EXPECT_GT(surface.Value({25, 50, 4}), 0);
  EXPECT_LT(surface.Value({85, 50, 4}), 0);
}

TEST(ImplicitSurface, RefusesInvalidDepths) {
  const TriMesh plate = Plate(10, 1);
  EXPECT_THROW(ImplicitSurface(plate, std::vector<double>(3, 5), {}), InputError);
  EXPECT_THROW(ImplicitSurface(plate, std::vector<double>(4, -1), {}), InputError);
  EXPECT_THROW(ImplicitSurface(plate, std::vector<double>(4, kNaN), {}), InputError);
}

TEST(ImplicitSurface, DensityIsTrianglesOnASquareOfTheDepth) {
  EXPECT_NEAR(Surface(Plate(100, 50), 10, FlatEmitter{}).EmittersPerSquareDepth(), 100 / 2.0, 1e-9);
}

}  // namespace
}  // namespace semblance::surfaces
